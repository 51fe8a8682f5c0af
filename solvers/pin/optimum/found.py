"""What a search for a shape answers with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Found:
    """A profile of some form.

    solidity   u at the program's stations
    volume     mass over that of the solid pin, exact for the shape
    proof      works out a proven lower bound of the volume, over this form on these stations
    corners    bore diameters [m] at places [m] on which the shape is straight lines; None: the stations say it all
    doubt      per panel, how far quadrature, or what lies between stations, may be off in the volume
    """

    solidity: Array
    volume: float
    proof: Callable[[], float]
    method: str
    evidence: Mapping[str, float | int | str] = field(default_factory=dict)
    corners: tuple[tuple[float, float], ...] | None = None
    doubt: Array | None = None

    @cached_property
    def bound(self) -> float:
        """What ``proof`` says, no more than the volume; only asked of the last of many stations."""
        return min(float(self.proof()), self.volume)
