"""Materials and criteria as kernel arrays, and multithreaded evaluation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.parallel import in_slices
from solvers.pin.closed_form.kernel import Pins, Results, evaluate
from solvers.pin.scene import PinMaterial
from solvers.pin.section.criteria import Criterion

Array = NDArray[np.float64]
_MAX_DEMANDS = 3


def demand_rows(criterion: Criterion, material: PinMaterial) -> Array:
    """Return the strength constraints in the layout of ``kernel.Pins``, (3, 3)."""
    rows = np.zeros((_MAX_DEMANDS, 3))
    for row, factors in zip(rows, criterion.factors, strict=False):
        row[:] = factors.bending / material.allowable_stress, factors.shear / material.allowable_stress, 1.0
    if material.allowable_shear is not None:
        rows[-1] = 0.0, 1.0 / material.allowable_shear, 0.0
    return rows


def law_row(criterion: Criterion, material: PinMaterial) -> tuple[float, float, float]:
    """Return the coefficients c0, c1, c2 of a tube's maximum shear stress under the criterion."""
    law = criterion.law(material)
    return law.c0, law.c1, law.c2


def evaluated(pins: Pins, ends: Array, walls: Array, threads: int = 1) -> Results:
    """Run ``evaluate`` on all pins, divided into one slice per thread."""
    count = walls.shape[0]
    out = Results(*(np.empty(count) for _ in Results._fields))

    def solve(part: slice) -> None:
        evaluate(Pins(*(a[part] for a in pins)), ends[part], walls[part], Results(*(a[part] for a in out)))

    in_slices(solve, count, threads)
    return out
