"""Mechanics of the strip under given force and lateral displacement: beam-column, buckling, shear, elastica."""
