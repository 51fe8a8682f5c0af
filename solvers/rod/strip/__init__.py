"""Mechanics of the strip under given force and stroke: beam-column, buckling, shear, elastica."""
