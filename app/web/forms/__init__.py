"""Forms generated from the request models, and their conversion to and from requests."""
