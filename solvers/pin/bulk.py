"""Bulk checks: lists of cases, with the same results as ``check``, and tables of pins with constant or stepped bores,
arrays in, arrays out.

Stepped bores under the rod force alone go through one compiled loop; all others are checked one by one.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.errors import InvalidInput, require
from solvers.numerics.arrays import Array
from solvers.outcome import Outcome
from solvers.pin.check import Case, Prepared
from solvers.pin.closed_form.kernel import Pins, evaluated, material_rows
from solvers.pin.closed_form.stepped_bore import evaluate_all
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.result import PinCheck
from solvers.pin.scene import PinMaterial
from solvers.pin.section.criteria import CRITERIA, Criterion


def check_many(cases: Iterable[Case]) -> list[Outcome[PinCheck] | InvalidInput]:
    """Return one outcome per case, in input order; an invalid case yields its InvalidInput."""
    found: list[Outcome[PinCheck] | InvalidInput | None] = []
    rows: list[tuple[int, Prepared]] = []
    for case in cases:
        try:
            prepared = case.prepared()
            if prepared.stepped is None:
                found.append(prepared.on_stations())
            else:
                rows.append((len(found), prepared))
                found.append(None)
        except InvalidInput as refusal:
            found.append(refusal)
    began = time.perf_counter()
    results = evaluate_all([prepared.stepped for _, prepared in rows])
    share = (time.perf_counter() - began) / max(len(rows), 1)
    for row, (place, prepared) in enumerate(rows):
        found[place] = prepared.in_closed_form(results, row, share)
    return found  # type: ignore[return-value]


@dataclass(frozen=True)
class PinTable:
    """Results of n pins, SI units, shape (n,) each.

    ``estimated`` is the relative rounding error of every number. ``force_limit`` is the capacity of the solid pin,
    NaN without a load; ``worst_section`` the position in the first half where the criterion's utilisation is
    greatest. Deflection, stresses and utilisation are infinite where a loaded section has no wall.
    """

    mass: Array
    solid_mass: Array
    deflection: Array
    equivalent_stress_max: Array
    shear_stress_max: Array
    strength_utilisation: Array
    worst_section: Array
    max_moment: Array
    max_shear: Array
    least_wall: Array
    force_limit: Array
    estimated: float = ROUNDING


def check_bores(
    outer_diameter: ArrayLike,
    boss_length: ArrayLike,
    small_end_length: ArrayLike,
    gap: ArrayLike,
    force: ArrayLike,
    material: PinMaterial,
    bores: ArrayLike,
    ends: ArrayLike | None = None,
    criterion: Criterion = CRITERIA["tresca_paper"],
    shear_deflection: bool = True,
    threads: int = 1,
) -> PinTable:
    """Check pins of one material with constant or stepped bores, SI units.

    D, a, b, delta and P have shape (n,) or are scalars. ``bores`` (n, k), or (n,) if constant, are the step
    diameters of the first half from the end to the middle; ``ends`` (n, k) or (k,) are the non-decreasing end
    positions of the steps, clipped at the middle. The other half is mirrored. The pins are divided among the
    threads, which release the GIL. Raises InvalidInput for invalid dimensions.
    """
    bores = np.asarray(bores, dtype=float)
    bores = bores[:, None] if bores.ndim == 1 else bores
    count, steps = bores.shape
    sizes = np.empty((count, 5))
    for column, given in enumerate((outer_diameter, boss_length, small_end_length, gap, force)):
        sizes[:, column] = given
    _require_pins(sizes, bores)
    if ends is None:
        require(steps == 1, "ends", "is missing", "where every step ends")
        ends = np.inf
    places = np.ascontiguousarray(np.broadcast_to(np.asarray(ends, dtype=float), bores.shape))
    require(bool(np.all(np.diff(places, axis=1) >= 0.0)), "ends", "must not fall", "rising places")
    rows = material_rows(criterion, material, shear_deflection)
    walls = (sizes[:, :1] - bores) / sizes[:, :1]
    pins = Pins(sizes, *(np.repeat(row[None], count, axis=0) for row in rows))
    found = evaluated(pins, places, walls, threads)
    solid = material.density * 0.25 * np.pi * sizes[:, 0] ** 2 * (2.0 * (sizes[:, 1] + sizes[:, 3]) + sizes[:, 2])
    allowable_shear = np.nan if material.allowable_shear is None else material.allowable_shear
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = np.where(found.solid > 0.0, sizes[:, 4] / found.solid, np.nan)
    return PinTable(
        solid * found.volume,
        solid,
        found.deflection,
        material.allowable_stress * found.criterion,
        allowable_shear * found.shear,
        np.maximum(found.criterion, found.shear),
        found.worst,
        found.moment,
        found.force,
        0.5 * sizes[:, 0] * walls.min(axis=1),
        limit,
    )


def _require_pins(sizes: Array, bores: Array) -> None:
    """Raise InvalidInput for dimensions and bores that do not describe a pin."""
    for column, name in enumerate(("outer_diameter", "boss_length", "small_end_length")):
        good = np.isfinite(sizes[:, column]) & (sizes[:, column] > 0.0)
        require(bool(good.all()), name, "must be positive", "(0, inf)")
    for column, name in ((3, "gap"), (4, "force")):
        good = np.isfinite(sizes[:, column]) & (sizes[:, column] >= 0.0)
        require(bool(good.all()), name, "must not be negative", "[0, inf)")
    require(bool(np.all((bores >= 0.0) & (bores <= sizes[:, :1]))), "bores", "leave no pin", "[0, outer diameter]")
