"""Gauges: quantities of which the greatest value over the turn is wanted, each a weighted sum read at one section.

What a machine shows at an instant - axial force, side force, clamp moment, and along the strip the force on the
tangent, V'' and V - adds up linearly to all that a check asks for: a fibre's stress is N/(b h) +- (E h/2) V'', a
contact load a sum of side force and moment. So a search knows gauges only, and no physics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FORCE, SIDE, MOMENT, TANGENT, CURVATURE, DEFLECTION = range(6)
"""Columns of the weights: P [N], T [N], M0 [N m], and at the gauge's section N [N], V'' [1/m], V [m]."""

COLUMNS = 6


def weights(*rows: dict[int, float]) -> Array:
    """Weights of so many gauges, shape (gauges, 6), from those that are not zero, by column."""
    out = np.zeros((len(rows), COLUMNS))
    for row, parts in enumerate(rows):
        for column, weight in parts.items():
            out[row, column] = weight
    return out


@dataclass(frozen=True)
class Gauges:
    """``weights`` (gauges, 6) and ``stations`` [m] (gauges,); those of equal station are read faster side by side."""

    weights: Array
    stations: Array

    @staticmethod
    def at_piston(weights: Array) -> Gauges:
        """Gauges that no section matters to."""
        return Gauges(weights, np.zeros(weights.shape[0]))
