"""``solvers.rod.strip.beam_column`` written with numpy functions for arrays: the reference for its kernels.

The equations, their limits and their source are those of that module. Everything is per unit lateral displacement:
curvatures in 1/m^2, slopes in 1/m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oracles.textbook.stumpff import stumpff, stumpff_scaled
from solvers.rod.strip.beam_column import FORWARD_LIMIT


@dataclass(frozen=True)
class BeamConstants:
    """The solution per unit lateral displacement, one entry per value of q (shape (n,)).

    clamp_curvature   C = V''(0) [1/m^2]
    clamp_shear       D = V'''(0) [1/m^3]; the transverse force is -EI D
    head_curvature    V''(l) [1/m^2]
    determinant       det exp(-sqrt(max(q, 0)) l) [m^3]; not positive at and beyond buckling
    """

    coupling: NDArray[np.float64]
    length: float
    rod_length: float
    clamp_curvature: NDArray[np.float64]
    clamp_shear: NDArray[np.float64]
    head_curvature: NDArray[np.float64]
    determinant: NDArray[np.float64]

    @property
    def stable(self) -> bool:
        """Whether every q lies above the first buckling load (see ``solvers.rod.strip.buckling``)."""
        return bool(np.all(self.determinant > 0))


def solve(coupling: ArrayLike, length: float, rod_length: float) -> BeamConstants:
    """The constants C, D and V''(l) per unit lateral displacement for each coupling q = P/EI [1/m^2], shape (n,)."""
    q = np.atleast_1d(np.asarray(coupling, dtype=float))
    l, e = length, rod_length - length
    c = stumpff_scaled(-q * l * l)
    det = l**3 * (c.c2 - c.c3) + e * rod_length * l * c.c1
    # In two halves: the full decay may underflow.
    half = np.exp(-0.5 * np.sqrt(np.maximum(q, 0.0)) * l)
    with np.errstate(divide="ignore", invalid="ignore"):
        return BeamConstants(
            coupling=q,
            length=length,
            rod_length=rod_length,
            clamp_curvature=(l * c.c1 + e * c.c0) / det,
            clamp_shear=-(c.c0 + e * q * l * c.c1) / det,
            head_curvature=e * half / det * half,
            determinant=det,
        )


def curvature(constants: BeamConstants, stations: ArrayLike) -> NDArray[np.float64]:
    """V''(z) per unit lateral displacement at the stations z in [0, l]: shape (stations, couplings)."""
    z = np.atleast_1d(np.asarray(stations, dtype=float))[:, None]
    q, l = constants.coupling, constants.length
    strong = q * l * l > FORWARD_LIMIT
    out = np.empty((z.shape[0], q.size))
    weak = ~strong
    if weak.any():
        c = stumpff(-q[weak] * z * z)
        out[:, weak] = constants.clamp_curvature[weak] * c.c0 + constants.clamp_shear[weak] * z * c.c1
    if strong.any():
        k = np.sqrt(q[strong])
        span = -np.expm1(-2.0 * k * l)
        from_clamp = np.exp(-k * z) * -np.expm1(-2.0 * k * (l - z)) / span
        from_head = np.exp(-k * (l - z)) * -np.expm1(-2.0 * k * z) / span
        out[:, strong] = constants.clamp_curvature[strong] * from_clamp + constants.head_curvature[strong] * from_head
    return out


def _integrals(constants: BeamConstants, stations: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """V' and V per unit lateral displacement at the stations, each of shape (stations, couplings)."""
    z = np.atleast_1d(np.asarray(stations, dtype=float))[:, None]
    q, l = constants.coupling, constants.length
    strong = q * l * l > FORWARD_LIMIT
    weak = ~strong
    slope = np.empty((z.shape[0], q.size))
    deflection = np.empty_like(slope)
    if weak.any():
        c = stumpff(-q[weak] * z * z)
        first, second = constants.clamp_curvature[weak], constants.clamp_shear[weak]
        slope[:, weak] = first * z * c.c1 + second * z**2 * c.c2
        deflection[:, weak] = first * z**2 * c.c2 + second * z**3 * c.c3
    if strong.any():
        # Integrated once and twice: q V' = V''' - D, q V = V'' - C - D z, with V'' from its two ends.
        k = np.sqrt(q[strong])
        span = -np.expm1(-2.0 * k * l)
        clamp, shear = constants.clamp_curvature[strong], constants.clamp_shear[strong]
        head = constants.head_curvature[strong]
        down, up = np.exp(-k * z), np.exp(-k * (l - z))
        down_image, up_image = np.exp(-k * (2.0 * l - z)), np.exp(-k * (l + z))
        third = k * (head * (up + up_image) - clamp * (down + down_image)) / span
        second = (clamp * (down - down_image) + head * (up - up_image)) / span
        slope[:, strong] = (third - shear) / q[strong]
        deflection[:, strong] = (second - clamp - shear * z) / q[strong]
    return slope, deflection


def slope(constants: BeamConstants, stations: ArrayLike) -> NDArray[np.float64]:
    """V'(z) per unit lateral displacement at the stations: shape (stations, couplings)."""
    return _integrals(constants, stations)[0]


def deflection(constants: BeamConstants, stations: ArrayLike) -> NDArray[np.float64]:
    """V(z) per unit lateral displacement (dimensionless) at the stations: shape (stations, couplings)."""
    return _integrals(constants, stations)[1]
