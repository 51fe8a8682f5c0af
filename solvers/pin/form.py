"""What a form of bore is: the lightest profile of its shape, with a bound that no such profile undercuts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solvers.pin.program import Program

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Found:
    """A profile of some form.

    solidity   u at the program's stations
    volume     mass over that of the solid pin, exact for the shape
    bound      proven lower bound of the volume, over this form on these stations
    corners    bore diameters [m] at places [m] on which the shape is straight lines; None: the stations say it all
    doubt      per panel, how far quadrature, or what lies between stations, may be off in the volume
    """

    solidity: Array
    volume: float
    bound: float
    method: str
    evidence: Mapping[str, float | int | str] = field(default_factory=dict)
    corners: tuple[tuple[float, float], ...] | None = None
    doubt: Array | None = None

    @property
    def doubted(self) -> float:
        """How far the volume may be off, relative."""
        return 0.0 if self.doubt is None or self.volume == 0.0 else float(self.doubt.sum()) / self.volume


class Form(Protocol):
    """A family of profiles."""

    name: str

    def find(self, program: Program, gap: float) -> Found | None:
        """The lightest profile on the program's stations, its bound within ``gap`` where the form can promise that;
        None where even the solid pin deflects too much. ``program.lower`` holds no NaN."""
