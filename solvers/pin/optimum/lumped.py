"""Reduced programs whose stations are whole segments of uniform wall."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.pin.optimum.program import Program, folded
from solvers.pin.stations.lobatto_panels import Stations

Array = NDArray[np.float64]


def segments(program: Program, low: Array, parts: list[slice]) -> Program:
    """Return the program with one u per segment: its lower bounds, shares and mean coefficients."""
    half = folded(program)
    share = np.array([half.share[part].sum() for part in parts])
    mean = [
        [float(half.share[p] @ c[p]) / w for p, w in zip(parts, share, strict=True)] for c in (half.bending, half.shear)
    ]
    edges = np.concatenate([[0.0], np.cumsum(share)])
    reduced = Lumped(edges[:-1], edges[1:], share)
    return replace(
        half, stations=reduced, lower=low, bending=np.array(mean[0]), shear=np.array(mean[1]), anchor=share.size
    )


@dataclass(frozen=True)
class Lumped(Stations):
    """Stations that represent whole segments; only their shares are meaningful."""

    weights: Array

    @property
    def share(self) -> Array:  # type: ignore[override]
        return self.weights
