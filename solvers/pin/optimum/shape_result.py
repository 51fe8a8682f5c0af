"""Result of a shape search.

Every form of ``solvers.pin.shapes`` has ``find(program, gap)``: the lightest profile on the program's stations, whose
``lower`` contains no NaN, with its bound within ``gap`` if the form can achieve that; None if even the solid pin
exceeds the deflection limit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from solvers.numerics.arrays import Array


@dataclass(frozen=True)
class ShapeResult:
    """Lightest profile of a form.

    solidity        u at the program's stations
    volume          mass relative to the solid pin, exact for the shape
    proof           function that computes a proven lower bound of the volume over this form on these stations
    corners         (position [m], diameter [m]) vertices of a piecewise linear shape; None: given by the stations
    error_estimate  of the volume, per panel: quadrature error, or missed extrema between stations
    """

    solidity: Array
    volume: float
    proof: Callable[[], float]
    method: str
    evidence: Mapping[str, float | int | str] = field(default_factory=dict)
    corners: tuple[tuple[float, float], ...] | None = None
    error_estimate: Array | None = None

    @cached_property
    def bound(self) -> float:
        """Lower bound of the volume, computed on first access, usually only on the final stations."""
        return min(float(self.proof()), self.volume)
