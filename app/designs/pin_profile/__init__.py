"""The kind pin-profile: piston pins and bushings."""
