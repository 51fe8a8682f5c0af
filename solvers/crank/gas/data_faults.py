"""Faults of indicator data: detection, the offending point, and repair on request.

Data is never repaired silently: by default a faulty table or stroke is rejected, naming the point; a requested repair
returns valid data and a record of the changes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array

REVOLUTION = 2.0 * math.pi
END_GAP = 5e-3
"""Fraction of the swept volume by which a stroke's points may miss a dead centre; the end's pressure is extended."""

_RADIANS_PER_DEGREE = math.pi / 180.0
_CLOSURE_TOLERANCE = 1e-6
"""Fraction of the pressure range by which the two ends of a closed table may differ."""
_REPEATED = 1e-12
"""Distance of repeated points, as a fraction of the range."""
_MAX_ROUNDS = 12


class Points(NamedTuple):
    """Abscissae (angles [rad] or volumes [m3]) and pressures [Pa], and the range they should cover."""

    x: Array
    pressure: Array
    low: float
    high: float

    @property
    def span(self) -> float:
        return self.high - self.low

    @property
    def steps(self) -> Array:
        """From the point before to each, 0 for the first."""
        return np.diff(self.x, prepend=self.x[0])

    def select(self, kept: Array) -> Points:
        return self._replace(x=self.x[kept], pressure=self.pressure[kept])


class Fault(NamedTuple):
    """A kind of fault: a mask (n,) of the points that have it, what is wrong and what is allowed.

    ``repaired`` describes its repair, none if empty, and ``repair`` does it: by default the points are left out.
    """

    offending: Callable[[Points], NDArray[np.bool_]]
    reason: str
    allowed: str
    repaired: str = ""
    repair: Callable[[Points], Points] | None = None

    def allows(self, points: Points) -> str:
        """What is allowed, with the volumes [cm^3] in place of each {}."""
        return self.allowed.format(f"{1e6 * points.low:.5g}", f"{1e6 * points.high:.5g}")


@dataclass(frozen=True)
class Repair:
    """A repair of a user's data: the field of the first offending point, and a description for the record."""

    field: str
    what: str


def _last(points: Points, offends: bool) -> NDArray[np.bool_]:
    """Mask of the last point if ``offends``, otherwise of none."""
    return np.append(np.zeros(points.x.size - 1, bool), offends)


def _second_turn(points: Points) -> NDArray[np.bool_]:
    """Points after the angle of a four-stroke cycle starts at zero again."""
    back = points.steps < 0
    relabelled = points.span > 1.5 * REVOLUTION and np.ptp(points.x) <= 1.01 * REVOLUTION
    return np.logical_or.accumulate(back) & (
        relabelled and np.sum(back) == 1 and points.steps.min() < -0.75 * REVOLUTION
    )


def _one_turn(points: Points) -> NDArray[np.bool_]:
    """The last point of a four-stroke cycle that ends after one turn."""
    return _last(points, points.span > 1.5 * REVOLUTION and 0.8 * REVOLUTION <= np.ptp(points.x) <= 1.001 * REVOLUTION)


def _turning_back(points: Points) -> NDArray[np.bool_]:
    """Steps against the stroke's prevailing direction."""
    rising = np.sum(points.steps > 0) >= np.sum(points.steps < 0)
    return points.steps < 0 if rising else points.steps > 0


def _unclosed(points: Points) -> NDArray[np.bool_]:
    """The last point one cycle after the first, with another pressure."""
    repeats_first = abs(points.x[-1] - points.x[0] - points.span) <= 1e-9 * points.span
    gap = abs(points.pressure[-1] - points.pressure[0])
    return _last(points, repeats_first and gap > _CLOSURE_TOLERANCE * np.ptp(points.pressure))


def _outside(points: Points) -> NDArray[np.bool_]:
    tolerance = END_GAP * points.span
    return (points.x < points.low - tolerance) | (points.x > points.high + tolerance)


def _missing_ends(points: Points) -> list[tuple[int, float]]:
    """For each dead centre that the points do not reach, the index of the nearest one and the volume."""
    tolerance, low, high = END_GAP * points.span, int(np.argmin(points.x)), int(np.argmax(points.x))
    found = [(low, points.low)] if points.x[low] > points.low + tolerance else []
    return [*found, (high, points.high)] if points.x[high] < points.high - tolerance else found


def _in_order(points: Points) -> Points:
    return points.select(np.argsort(points.x, kind="stable"))


def _averaged(points: Points) -> Points:
    points = _in_order(points)
    first = np.diff(points.x, prepend=-np.inf) > _REPEATED * points.span
    group = np.cumsum(first) - 1
    return points._replace(x=points.x[first], pressure=np.bincount(group, points.pressure) / np.bincount(group))


def _closed(points: Points) -> Points:
    mean = 0.5 * (points.pressure[0] + points.pressure[-1])
    return points._replace(pressure=np.concatenate([[mean], points.pressure[1:-1], [mean]]))


def _extended(points: Points) -> Points:
    for last, end in _missing_ends(points):
        points = points._replace(x=np.append(points.x, end), pressure=np.append(points.pressure, points.pressure[last]))
    return _in_order(points)


_REPEATED_POINT = Fault(
    lambda p: np.abs(np.diff(p.x, prepend=-np.inf)) <= _REPEATED * p.span,
    "repeats an earlier point",
    "one pressure for each place",
    "repeated points replaced by their mean",
    _averaged,
)
TABLE_FAULTS = (
    Fault(
        lambda p: _last(p, 0.8 * REVOLUTION <= np.ptp(p.x) / _RADIANS_PER_DEGREE <= 1.001 * p.span),
        "the angles span 2 pi or 4 pi degrees: they look like radians",
        "degrees over the whole cycle",
        "angles taken as radians",
        lambda p: p._replace(x=p.x / _RADIANS_PER_DEGREE),
    ),
    Fault(
        _second_turn,
        "the angle starts again: the second turn of the cycle is labelled like the first",
        "rising angles over two turns",
        "a turn added to the angles from this point on",
        lambda p: p._replace(x=p.x + REVOLUTION * _second_turn(p)),
    ),
    Fault(lambda p: p.steps < 0, "does not follow the point before it", "points in order", "points sorted", _in_order),
    _REPEATED_POINT,
    Fault(
        _one_turn,
        "the angles of a four-stroke cycle end after one turn: two turns labelled as one, or half the data",
        "angles over two turns, or strokes 2",
        "all angles doubled",
        lambda p: p._replace(x=p.x[0] + 2.0 * (p.x - p.x[0])),
    ),
    Fault(
        lambda p: p.x - p.x[0] > p.span * (1.0 + 1e-9),
        "lies more than one cycle after the first",
        "one cycle: one turn for two strokes, two turns for four",
        "points beyond one cycle left out",
    ),
    Fault(
        _unclosed,
        "lies one cycle after the first point, with another pressure: the cycle is not closed",
        "the first point's pressure, or no such point",
        "first and last point replaced by their mean",
        _closed,
    ),
    Fault(
        lambda p: np.diff(p.x, append=p.x[0] + p.span) > 0.5 * p.span,
        "more than half of the cycle after this point holds no other",
        "points all over the cycle",
    ),
)
STROKE_FAULTS = (
    Fault(
        _outside,
        "lies outside the volumes of the cylinder",
        "between {} and {} cm³, by clearance volume, bore and crank radius",
        "points outside the cylinder's volumes left out",
    ),
    Fault(
        _turning_back,
        "the volume turns back within the stroke",
        "volumes that only rise or only fall",
        "points sorted by volume",
        _in_order,
    ),
    _REPEATED_POINT,
    Fault(
        lambda p: np.isin(np.arange(p.x.size), [last for last, _ in _missing_ends(p)]),
        "is the last before a dead centre that the points do not reach",
        "points from {} to {} cm³, by clearance volume, bore and crank radius",
        "pressure held to the dead centre",
        _extended,
    ),
)


def _first_fault(points: Points, faults: Sequence[Fault]) -> tuple[Fault, int] | None:
    """Return the first fault of data and the index of the offending point."""
    for fault in faults:
        found = np.flatnonzero(fault.offending(points))
        if found.size:
            return fault, int(found[0])
    return None


def require_finite(field: str, **columns: Sequence[float]) -> None:
    """Raise InvalidInput, naming the first point, for columns with infinite or NaN values."""
    for name, values in columns.items():
        if not all(map(math.isfinite, values)):  # takes a third of the time needed to build an array
            first = next(index for index, value in enumerate(values) if not math.isfinite(value))
            raise InvalidInput(f"{field}.{name}.{first}", "must be finite", "finite numbers")


def require_sound_table(points: Points) -> None:
    """Raise InvalidInput, naming the first offending point, for a faulty table."""
    x, span = points.x, points.span
    reach, steps = x[-1] - x[0], np.diff(x)
    # Such data has no fault; testing each fault separately takes ten times as long.
    one_cycle = max(0.5 * span, 1.001 * REVOLUTION if span > 1.5 * REVOLUTION else 0.0) < reach < (1.0 - 1e-9) * span
    if not (one_cycle and steps.min() > 1e-12 * span and steps.max() <= 0.5 * span):
        require_sound(points, TABLE_FAULTS, "pressure.angle")


def require_sound(points: Points, faults: Sequence[Fault], field: str) -> None:
    """Raise InvalidInput, naming the field's first offending point, for data with one of these faults."""
    found = _first_fault(points, faults)
    if found is not None:
        raise InvalidInput(f"{field}.{found[1]}", found[0].reason, found[0].allows(points))


def repaired(points: Points, faults: Sequence[Fault], field: str, least: int) -> tuple[Points, list[Repair]]:
    """Repair the faults one by one, leaving ``least`` points; raises InvalidInput for irreparable data."""
    repairs: list[Repair] = []
    while (found := _first_fault(points, faults)) is not None:
        (fault, index), mended = found, points
        if fault.repaired:
            mended = fault.repair(points) if fault.repair else points.select(~fault.offending(points))
        if mended is points or mended.x.size < least or len(repairs) == _MAX_ROUNDS:
            raise InvalidInput(f"{field}.{index}", fault.reason + "; this cannot be repaired", fault.allows(points))
        points = mended
        repairs.append(Repair(f"{field}.{index}", fault.repaired))
    return points, repairs
