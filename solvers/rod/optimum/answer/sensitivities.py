"""What each active constraint is worth: the Karush-Kuhn-Tucker multipliers of the optimum.

In logarithms the multiplier of a constraint is the sensitivity itself: ln objective moves by the multiplier for every
unit by which ln limit moves. Multipliers >= 0 come from nonnegative least squares over everything that holds with
equality (C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, 1974).
"""

from __future__ import annotations

import math

import numpy as np

from solvers.outcome import ActiveConstraint
from solvers.rod.optimum import constraints as rows
from solvers.rod.optimum.machine import Machine
from solvers.rod.optimum.peak_model import SIDEWAYS, STRESS, row_count, rows_and_slopes
from solvers.rod.optimum.sqp import Limits, Polished, parts_of
from solvers.rod.problem import Bounds, Objective

_ACTIVE = 1e-6
_NEGLIGIBLE = 1e-6


def active_constraints(
    machine: Machine, objective: Objective, limits: Limits, bounds: Bounds, sizes: Bounds, best: Polished
) -> tuple[ActiveConstraint, ...]:
    """The constraints that hold with equality and shape the optimum, with d ln objective/d ln bound.

    ``sizes`` are the bounds narrowed to the sizes that are to be had: a dimension with freedom in ``bounds`` but none
    there is named ``h_size`` and so on, its sensitivity that to the size itself.
    """
    d, focus = best.dimensions, best.focus
    values = np.empty(row_count(focus))
    slopes = np.empty((values.size, 3))
    table = np.empty((focus.force.size, focus.eta.size))
    rows_and_slopes(focus, np.log([d.b, d.h, d.l]), table, values, slopes)

    names: list[str] = []
    signs: list[float] = []
    columns: list[np.ndarray] = []

    def offer(name: str, row: int, log_limit: float, sign: float) -> None:
        if abs(values[row] - log_limit) < _ACTIVE:
            names.append(name)
            signs.append(sign)
            columns.append(np.append(slopes[row], 0.0))

    for row in (rows.STABILITY, SIDEWAYS):
        offer("min_stability_safety", row, -math.log(limits.stability), -1.0)
    if limits.fatigue is not None:
        for row in parts_of(focus, rows.UTILISATION):
            offer("min_fatigue_safety", row, -math.log(limits.fatigue), -1.0)
    if limits.stress is not None:
        offer("min_yield_safety", STRESS, math.log(limits.stress), -1.0)
    if limits.pressure is not None:
        for row in parts_of(focus, rows.PRESSURE):
            offer("max_contact_pressure", row, math.log(limits.pressure), 1.0)
    if limits.power is not None:
        offer("max_friction_power", rows.POWER, math.log(limits.power), 1.0)
    for index, name in enumerate(("b", "h", "l")):
        value, (low, high) = getattr(d, name), getattr(bounds, name)
        high = min(high, machine.rod_length) if name == "l" else high
        if low < high and len(set(getattr(sizes, name))) == 1:
            for sign in (-1.0, 1.0):
                names.append(f"{name}_size")
                signs.append(sign)
                columns.append(np.append(sign * np.eye(3)[index], 0.0))
            continue
        for side, bound, sign in (("lower", low, -1.0), ("upper", high, 1.0)):
            if abs(math.log(value / bound)) < _ACTIVE:
                names.append(f"{name}_{side}")
                signs.append(sign)
                columns.append(np.append(sign * np.eye(3)[index], 0.0))
    weights = dict(objective.weights)
    target = np.zeros(4)
    topped = next((row for row in weights if len(parts_of(focus, row)) > 1), None)
    target[3] = weights.pop(topped, 0.0)
    for row, weight in weights.items():
        target[:3] -= weight * slopes[row]
    if target[3]:
        # A greatest of several: shares of those that govern, which add up to one.
        for row in parts_of(focus, topped):
            if values[topped] - values[row] < _ACTIVE:
                names.append("")
                signs.append(0.0)
                columns.append(np.append(slopes[row], 1.0))
    if not columns:
        return ()
    from scipy.optimize import nnls

    found, _ = nnls(np.array(columns).T, target)
    totals: dict[str, float] = {}
    for name, sign, multiplier in zip(names, signs, found, strict=True):
        if name:
            # A limit let out by d ln moves ln cost by -multiplier; a least safety is let out downward.
            totals[name] = totals.get(name, 0.0) - objective.sign * sign * multiplier
    return tuple(ActiveConstraint(name, float(value)) for name, value in totals.items() if abs(value) > _NEGLIGIBLE)
