"""Repair of indicator data on request.

Data is never repaired silently: by default a faulty table or stroke is rejected, naming the point (``data_faults``); a
requested repair returns valid data and a record of the changes.
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

_MAX_ROUNDS = 12


@dataclass(frozen=True)
class Repair:
    """A repair of a user's data: the field of the first offending point, and a description for the record."""

    field: str
    what: str


def _repaired(points: Points, faults: Sequence[Fault], field: str, least: int) -> tuple[Points, list[Repair]]:
    """Repair the faults one by one; raises InvalidInput for irreparable data."""
    repairs: list[Repair] = []
    for _ in range(_MAX_ROUNDS):
        found = first_fault(points, faults)
        if found is None:
            return points, repairs
        fault, index = found
        if not fault.repair:
            break
        repaired_points = fault.repaired(points)
        if repaired_points.x.size < least:
            break
        points = repaired_points
        repairs.append(Repair(f"{field}.{index}", fault.repair))
    fault, index = first_fault(points, faults) or found
    raise InvalidInput(f"{field}.{index}", fault.reason + "; this cannot be repaired", fault.allowed)


def repaired_table(table: TablePressure, cylinder: Cylinder) -> tuple[TablePressure, tuple[Repair, ...]]:
    """Return the repaired table and the repairs. Raises InvalidInput for irreparable data."""
    given = Points(np.asarray(table.angle), np.asarray(table.pressure), 0.0, cylinder.period)
    points, repairs = _repaired(given, TABLE_FAULTS, "pressure.angle", 3)
    return TablePressure(tuple(points.x.tolist()), tuple(points.pressure.tolist())), tuple(repairs)


def repaired_indicator(
    diagram: IndicatorPressure, cylinder: Cylinder, motion: ExactMotion
) -> tuple[IndicatorPressure, tuple[Repair, ...]]:
    """Return the repaired diagram and the repairs. Raises InvalidInput for irreparable data."""
    low, swept = cylinder.clearance_volume, cylinder.area * motion.stroke
    strokes, repairs = [], []
    for index, stroke in enumerate(diagram.strokes):
        points = Points(np.asarray(stroke.volume), np.asarray(stroke.pressure), low, low + swept)
        repaired_points, applied = _repaired(points, STROKE_FAULTS, f"pressure.strokes.{index}.volume", 2)
        strokes.append(Stroke(tuple(repaired_points.x.tolist()), tuple(repaired_points.pressure.tolist())))
        repairs += applied
    return IndicatorPressure(tuple(strokes)), tuple(repairs)
