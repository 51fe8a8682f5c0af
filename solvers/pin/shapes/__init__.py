"""Forms of a bore or an outer profile."""
