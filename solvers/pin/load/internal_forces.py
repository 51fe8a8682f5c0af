"""Stress resultants of a load case at stations: bending moments, shear forces, axial force, torque."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.pieces import piece_at
from solvers.pin.load.macaulay import LoadCase


@dataclass(frozen=True)
class InternalForces:
    """Resultants at n stations: bending moments [N m] and shear forces [N] in two planes (2, n), axial force,
    torque; ``planar``: those of the second plane are known to be zero."""

    moment: Array
    shear: Array
    axial_force: float
    torque: float
    planar: bool = False

    @cached_property
    def moment_total(self) -> Array:
        return self._magnitude(self.moment)

    @cached_property
    def shear_total(self) -> Array:
        return self._magnitude(self.shear)

    def _magnitude(self, planes: Array) -> Array:
        return np.abs(planes[0]) if self.planar else np.hypot(planes[0], planes[1])


def forces_at(case: LoadCase, x: Array, panel_start: Array, residual: Array | None = None) -> InternalForces:
    """Return the resultants of a case at stations ``x``, with their rounding residuals ``residual``.

    A term acts if it starts at or before ``panel_start`` (same shape as x): at a point force the forces of a station
    are those on its panel's side.
    """
    residual = np.zeros_like(x) if residual is None else residual
    moment, shear = np.zeros((2, 2, x.size))
    for plane, pieces in enumerate(case.pieces):
        if pieces.start.size:
            _evaluate(
                x, residual, panel_start, pieces.start, pieces.residual, pieces.shear, pieces.moment,
                moment[plane], shear[plane],
            )  # fmt: skip
    return InternalForces(moment, shear, case.axial_force, case.torque, not case.pieces[1].start.size)


@kernel
def _evaluate(
    x: Array, residual: Array, panel_start: Array, start: Array, start_residual: Array, c: Array, m: Array,
    moment: Array, shear: Array,
) -> None:  # fmt: skip
    k = 0
    for i in range(x.size):
        k = piece_at(start, panel_start[i], k)
        if start[k] > panel_start[i]:
            continue
        t = (x[i] - start[k]) + (residual[i] - start_residual[k])
        shear[i] = c[0, k] + t * (c[1, k] + t * (c[2, k] + t * c[3, k]))
        moment[i] = m[k] + t * (c[0, k] + t * (c[1, k] / 2.0 + t * (c[2, k] / 3.0 + t * c[3, k] / 4.0)))
