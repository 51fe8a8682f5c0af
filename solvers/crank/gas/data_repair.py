"""Mending indicator data when its user asks for it.

Data is never mended in silence: a table or a stroke with a fault is refused with the point named (``faults``); who asks
for repair gets sound data and a record of what was done to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solvers.crank.gas.cylinder import Cylinder
from solvers.crank.gas.data_faults import STROKE_FAULTS, TABLE_FAULTS, Fault, Points, first_fault
from solvers.crank.gas.indicator_diagram import IndicatorPressure, Stroke
from solvers.crank.gas.pressure_table import TablePressure
from solvers.crank.motion.slider_crank import ExactMotion
from solvers.errors import InvalidInput

_MOST_ROUNDS = 12


@dataclass(frozen=True)
class Repair:
    """What was done to a user's data: the field where the fault was first seen, and the sentence for the record."""

    field: str
    what: str


def _mended(points: Points, faults: Sequence[Fault], field: str, least: int) -> tuple[Points, list[Repair]]:
    """Mend fault after fault; raises InvalidInput for what cannot be mended."""
    repairs: list[Repair] = []
    for _ in range(_MOST_ROUNDS):
        found = first_fault(points, faults)
        if found is None:
            return points, repairs
        fault, index = found
        if not fault.repair:
            break
        mended = fault.mend(points)
        if mended.x.size < least:
            break
        points = mended
        repairs.append(Repair(f"{field}.{index}", fault.repair))
    fault, index = first_fault(points, faults) or found
    raise InvalidInput(f"{field}.{index}", fault.reason + "; this cannot be repaired", fault.allowed)


def repaired_table(table: TablePressure, cylinder: Cylinder) -> tuple[TablePressure, tuple[Repair, ...]]:
    """The table made sound, and what was done. Raises InvalidInput for what cannot be mended."""
    given = Points(np.asarray(table.angle), np.asarray(table.pressure), 0.0, cylinder.period)
    points, repairs = _mended(given, TABLE_FAULTS, "pressure.angle", 3)
    return TablePressure(tuple(points.x.tolist()), tuple(points.pressure.tolist())), tuple(repairs)


def repaired_indicator(
    diagram: IndicatorPressure, cylinder: Cylinder, motion: ExactMotion
) -> tuple[IndicatorPressure, tuple[Repair, ...]]:
    """The diagram made sound, and what was done. Raises InvalidInput for what cannot be mended."""
    low, swept = cylinder.clearance_volume, cylinder.area * motion.stroke
    strokes, repairs = [], []
    for index, stroke in enumerate(diagram.strokes):
        points = Points(np.asarray(stroke.volume), np.asarray(stroke.pressure), low, low + swept)
        mended, done = _mended(points, STROKE_FAULTS, f"pressure.strokes.{index}.volume", 2)
        strokes.append(Stroke(tuple(mended.x.tolist()), tuple(mended.pressure.tolist())))
        repairs += done
    return IndicatorPressure(tuple(strokes)), tuple(repairs)
