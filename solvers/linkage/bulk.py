"""Batch evaluation of many linkages, with the same results as ``check``."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput, require
from solvers.linkage.check import Case
from solvers.linkage.loads.torque_and_pin_force import TORQUE, peaks_per_energy
from solvers.linkage.mechanism.change_point import ChangePoint, Gain, Ratios
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.linkage.result import LinkageCheck
from solvers.linkage.swept_area.bounding_box import minimum_box_areas
from solvers.linkage.swept_area.enclosing_circle import enclosing_radii
from solvers.linkage.swept_area.outline import outlines
from solvers.numerics.arrays import Array
from solvers.numerics.parallel import in_slices
from solvers.outcome import Outcome, evaluated

_NEAR_LIMIT = 1e-3
"""Above this relative distance from the least free ratio, the distance keeps twelve digits; below it, it is computed
exactly, one number at a time."""
_ORIENTATION = 1e-13


def check_many(cases: Iterable[Case]) -> list[Outcome[LinkageCheck] | InvalidInput]:
    """Outcomes of all cases, in order; for an invalid case its InvalidInput."""
    return evaluated(cases)


@dataclass(frozen=True)
class LinkageTable:
    """Results of linkages of one kind, SI units, (n,) each, ``lengths`` (n, 4): base, crank, coupler, rocker.

    ``torque`` and ``force`` are the peaks at the crank and along the coupler. Box and circle are NaN if not requested;
    all results that require a full revolution are NaN where the crank does not rotate fully.
    """

    lengths: Array
    rotatable: NDArray[np.bool_]
    u31_start: Array
    u31_end: Array
    u31_max: Array
    restitution: Array
    swing: Array
    transmission_angle: Array
    torque: Array
    force: Array
    box_area: Array
    enclosing_radius: Array


def check_family(
    kind: ChangePoint,
    restitution: Array,
    parameter: Array,
    crank: Array,
    energy: Array,
    joint_radius: float | None = None,
    threads: int = 1,
) -> LinkageTable:
    """Evaluate linkages of one kind from R_k, free ratio, crank [m] and impact energy [J], each (n,) or scalar.

    With a ``joint_radius`` [m] the minimum box and circle are computed as well. The linkages are divided among threads,
    which release the GIL. Raises InvalidInput for a free ratio without a mechanism.
    """
    restitution, parameter, crank, energy = (
        np.ascontiguousarray(values, dtype=float)
        for values in np.broadcast_arrays(*(np.atleast_1d(v) for v in (restitution, parameter, crank, energy)))
    )
    require(bool(np.all(parameter > 1e-6)), f"ratios.{kind.parameter}", "must be positive", "(0, inf)")
    bar = FourBar(kind, _ratios(kind, restitution, parameter))
    reach = np.asarray(kind.pin_to_pivot(bar.ratios))
    require(bool(np.all(reach > 0.0)), f"ratios.{kind.parameter}", "gives no mechanism of this type", "above g²")
    rows, none, full = bar.coefficients, np.full(parameter.size, np.nan), np.flatnonzero(bar.rotatable)
    own, own_end = np.ascontiguousarray(rows[full]), np.ascontiguousarray(bar.u31_end[full])
    loads = _parallel(lambda part: peaks_per_energy(own[part], own_end[part], TORQUE, 3), full.size, threads)
    most, torque, force, area, radius = (none.copy() for _ in range(5))
    most[full] = np.maximum(loads[:, 4], np.maximum(bar.u31_start, bar.u31_end)[full])
    torque[full], force[full] = energy[full] * loads[:, 0], energy[full] / crank[full] * loads[:, 2]
    if joint_radius is not None:
        swept = np.ascontiguousarray(outlines(kind, bar.ratios, crank, bar.swing)[full])
        zero, one = np.zeros(full.size), np.ones(full.size)
        area[full] = _parallel(
            lambda part: minimum_box_areas(
                swept[part], one[part], zero[part], zero[part], 2.0 * joint_radius, np.inf, np.inf, _ORIENTATION, np.inf
            )[:, 0],
            full.size,
            threads,
        )
        radius[full] = _parallel(lambda part: enclosing_radii(swept[part]), full.size, threads) + joint_radius
    lengths = crank[:, None] * np.stack([rows[:, 0], np.ones_like(crank), rows[:, 1], rows[:, 2]], axis=1)
    return LinkageTable(
        lengths, bar.rotatable, bar.u31_start, bar.u31_end, most, bar.restitution, bar.swing,
        bar.middle_transmission_angle, torque, force, area, radius,
    )  # fmt: skip


def _parallel(solve: Callable[[slice], Array], count: int, threads: int) -> Array:
    """Results of a kernel for ``count`` rows."""
    return np.concatenate(in_slices(solve, count, threads))


def _ratios(kind: ChangePoint, restitution: Array, parameter: Array) -> Ratios:
    """The family's ratios as arrays, also exact near the least free ratio."""
    gain = Gain(restitution)
    found = {
        n: np.array(np.broadcast_to(v, parameter.shape), float) for n, v in vars(kind.family(gain, parameter)).items()
    }
    for i in np.flatnonzero(np.abs(parameter / kind.parameter_limit(gain) - 1.0) < _NEAR_LIMIT).tolist():
        exact = kind.family(Gain(float(restitution[i])), float(parameter[i]))
        for name, values in found.items():
            values[i] = getattr(exact, name)
    return Ratios(**found)
