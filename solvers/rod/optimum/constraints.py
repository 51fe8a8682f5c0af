"""The logarithms that objectives and limits of a strip's design are made of, by index.

In them the mass is linear, and a relative tolerance is an absolute one.
"""

TAU, LENGTH, THICKNESS, UTILISATION, STABILITY, SIDE, PRESSURE, POWER = range(8)
"""ln of 1/(b h^3), l, h, fatigue utilisation 1/n, compression/critical force, side force, contact pressure, power."""

COUNT = 8

NEVER_COMPRESSED = -700.0
"""ln(compression/critical force) of a strip that is never compressed: finite, and smaller than any other."""
