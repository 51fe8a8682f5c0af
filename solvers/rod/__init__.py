"""The flexible strip rod of a crank-slider machine."""
