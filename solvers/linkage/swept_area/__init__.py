"""The area swept by the mechanism."""
