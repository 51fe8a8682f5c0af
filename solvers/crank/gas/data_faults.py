"""Faults of indicator data: detection, the offending point, and the repair."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array

TURN = 2.0 * math.pi
END_GAP = 5e-3
"""Fraction of the swept volume by which a stroke's points may miss a dead centre; the end's pressure is extended."""

_DEGREE = math.pi / 180.0
_CLOSURE_TOLERANCE = 1e-6
"""Fraction of the pressure range by which the two ends of a closed table may differ."""


@dataclass(frozen=True)
class Points:
    """Abscissae (angles [rad] or volumes [m3]) and pressures [Pa], and the range they should cover."""

    x: Array
    pressure: Array
    low: float
    high: float

    @property
    def span(self) -> float:
        return self.high - self.low

    def taking(self, kept: Array) -> Points:
        return replace(self, x=self.x[kept], pressure=self.pressure[kept])


class Fault(Protocol):
    """A kind of data fault."""

    reason: str
    allowed: str
    repair: str

    def find(self, points: Points) -> int | None:
        """Return the index of the first offending point; None for valid data."""

    def mend(self, points: Points) -> Points:
        """Return the points with the fault repaired."""


def _first(condition: Array) -> int | None:
    found = np.flatnonzero(condition)
    return int(found[0]) if found.size else None


@dataclass(frozen=True)
class Radians:
    reason: str = "the angles span 2 pi or 4 pi degrees: they look like radians"
    allowed: str = "degrees over the whole cycle"
    repair: str = "angles taken as radians"

    def find(self, points: Points) -> int | None:
        reach = np.ptp(points.x) / _DEGREE
        return points.x.size - 1 if 0.8 * TURN <= reach <= 1.001 * points.span else None

    def mend(self, points: Points) -> Points:
        return replace(points, x=points.x / _DEGREE)


@dataclass(frozen=True)
class Relabelled:
    """The second turn of a four-stroke cycle restarts at zero."""

    reason: str = "the angle starts again: the second turn of the cycle is labelled like the first"
    allowed: str = "rising angles over two turns"
    repair: str = "a turn added to the angles from this point on"

    def find(self, points: Points) -> int | None:
        falls = np.flatnonzero(np.diff(points.x) < 0)
        if points.span < 1.5 * TURN or falls.size != 1 or np.ptp(points.x) > 1.01 * TURN:
            return None
        return int(falls[0]) + 1 if points.x[falls[0]] - points.x[falls[0] + 1] > 0.75 * TURN else None

    def mend(self, points: Points) -> Points:
        start = self.find(points)
        return replace(points, x=points.x + np.where(np.arange(points.x.size) >= start, TURN, 0.0))


@dataclass(frozen=True)
class Squeezed:
    """Two turns labelled as one."""

    reason: str = "the angles of a four-stroke cycle end after one turn: two turns labelled as one, or half the data"
    allowed: str = "angles over two turns, or strokes 2"
    repair: str = "all angles doubled"

    def find(self, points: Points) -> int | None:
        short = points.span > 1.5 * TURN and 0.8 * TURN <= np.ptp(points.x) <= 1.001 * TURN
        return points.x.size - 1 if short else None

    def mend(self, points: Points) -> Points:
        return replace(points, x=points.x[0] + 2.0 * (points.x - points.x[0]))


@dataclass(frozen=True)
class Unsorted:
    reason: str = "does not follow the point before it"
    allowed: str = "points in order"
    repair: str = "points sorted"

    def find(self, points: Points) -> int | None:
        found = _first(np.diff(points.x) < 0)
        return None if found is None else found + 1

    def mend(self, points: Points) -> Points:
        return points.taking(np.argsort(points.x, kind="stable"))


@dataclass(frozen=True)
class NotMonotone:
    """The volume is not monotone along a stroke."""

    reason: str = "the volume turns back within the stroke"
    allowed: str = "volumes that only rise or only fall"
    repair: str = "points sorted by volume"

    def find(self, points: Points) -> int | None:
        steps = np.diff(points.x)
        rising = np.sum(steps > 0) >= np.sum(steps < 0)
        found = _first(steps < 0 if rising else steps > 0)
        return None if found is None else found + 1

    def mend(self, points: Points) -> Points:
        return points.taking(np.argsort(points.x, kind="stable"))


@dataclass(frozen=True)
class Repeated:
    reason: str = "repeats an earlier point"
    allowed: str = "one pressure for each place"
    repair: str = "repeated points replaced by their mean"

    def find(self, points: Points) -> int | None:
        found = _first(np.abs(np.diff(points.x)) <= 1e-12 * points.span)
        return None if found is None else found + 1

    def mend(self, points: Points) -> Points:
        order = np.argsort(points.x, kind="stable")
        x, pressure = points.x[order], points.pressure[order]
        group = np.concatenate([[0], np.cumsum(np.diff(x) > 1e-12 * points.span)])
        first = np.concatenate([[True], np.diff(group) > 0])
        return replace(points, x=x[first], pressure=np.bincount(group, pressure) / np.bincount(group))


@dataclass(frozen=True)
class NotClosed:
    reason: str = "lies one cycle after the first point, with another pressure: the cycle is not closed"
    allowed: str = "the first point's pressure, or no such point"
    repair: str = "first and last point replaced by their mean"

    def find(self, points: Points) -> int | None:
        apart = abs(points.x[-1] - points.x[0] - points.span) <= 1e-9 * points.span
        gap = abs(points.pressure[-1] - points.pressure[0])
        return points.x.size - 1 if apart and gap > _CLOSURE_TOLERANCE * np.ptp(points.pressure) else None

    def mend(self, points: Points) -> Points:
        closed = points.pressure.copy()
        closed[0] = closed[-1] = 0.5 * (closed[0] + closed[-1])
        return replace(points, pressure=closed)


@dataclass(frozen=True)
class TooLong:
    reason: str = "lies more than one cycle after the first"
    allowed: str = "one cycle: one turn for two strokes, two turns for four"
    repair: str = "points beyond one cycle left out"

    def find(self, points: Points) -> int | None:
        return _first(points.x - points.x[0] > points.span * (1.0 + 1e-9))

    def mend(self, points: Points) -> Points:
        return points.taking(points.x - points.x[0] <= points.span * (1.0 + 1e-9))


@dataclass(frozen=True)
class Gaping:
    """More than half a cycle without a point, which cannot be interpolated or repaired."""

    reason: str = "more than half of the cycle after this point holds no other"
    allowed: str = "points all over the cycle"
    repair: str = ""

    def find(self, points: Points) -> int | None:
        return _first(np.diff(np.append(points.x, points.x[0] + points.span)) > 0.5 * points.span)

    def mend(self, points: Points) -> Points:
        return points


@dataclass(frozen=True)
class Outside:
    reason: str = "lies outside the volumes of the cylinder (clearance volume, bore and crank radius tell them)"
    allowed: str = "between the clearance volume and it plus the swept volume"
    repair: str = "points outside the cylinder's volumes left out"

    def _beyond(self, points: Points) -> Array:
        room = END_GAP * points.span
        return (points.x < points.low - room) | (points.x > points.high + room)

    def find(self, points: Points) -> int | None:
        return _first(self._beyond(points))

    def mend(self, points: Points) -> Points:
        return points.taking(~self._beyond(points))


@dataclass(frozen=True)
class Short:
    reason: str = "is the last before a dead centre that the points do not reach"
    allowed: str = "points from the clearance volume to it plus the swept volume"
    repair: str = "pressure held to the dead centre"

    def find(self, points: Points) -> int | None:
        room, low, high = END_GAP * points.span, int(np.argmin(points.x)), int(np.argmax(points.x))
        if points.x[low] > points.low + room:
            return low
        return high if points.x[high] < points.high - room else None

    def mend(self, points: Points) -> Points:
        low, high, room = int(np.argmin(points.x)), int(np.argmax(points.x)), END_GAP * points.span
        x, pressure = points.x, points.pressure
        if x[low] > points.low + room:
            x, pressure = np.append(x, points.low), np.append(pressure, pressure[low])
        if x[high] < points.high - room:
            x, pressure = np.append(x, points.high), np.append(pressure, pressure[high])
        order = np.argsort(x, kind="stable")
        return replace(points, x=x[order], pressure=pressure[order])


TABLE_FAULTS: tuple[Fault, ...] = (
    Radians(),
    Relabelled(),
    Unsorted(),
    Repeated(),
    Squeezed(),
    TooLong(),
    NotClosed(),
    Gaping(),
)
STROKE_FAULTS: tuple[Fault, ...] = (Outside(), NotMonotone(), Repeated(), Short())


def first_fault(points: Points, faults: Sequence[Fault]) -> tuple[Fault, int] | None:
    """Return the first fault of data and the index of the offending point."""
    for fault in faults:
        index = fault.find(points)
        if index is not None:
            return fault, index
    return None


def require_finite(field: str, **columns: Sequence[float]) -> None:
    """Raise InvalidInput, naming the first point, for columns with infinite or NaN values."""
    for name, values in columns.items():
        if not np.isfinite(values).all():
            first = _first(~np.isfinite(values))
            raise InvalidInput(f"{field}.{name}.{first}", "must be finite", "finite numbers")


def require_sound_table(points: Points) -> None:
    """Raise InvalidInput, naming the first offending point, for a faulty table."""
    x, span = points.x, points.span
    reach, steps = x[-1] - x[0], np.diff(x)
    # Such data has no fault; testing each fault separately takes ten times as long.
    one_cycle = max(0.5 * span, 1.001 * TURN if span > 1.5 * TURN else 0.0) < reach < (1.0 - 1e-9) * span
    if not (one_cycle and steps.min() > 1e-12 * span and steps.max() <= 0.5 * span):
        _require_sound(points, TABLE_FAULTS, "pressure.angle")


def require_sound_stroke(points: Points, field: str) -> None:
    """Raise InvalidInput, naming the field's first offending point, for a faulty stroke."""
    _require_sound(points, STROKE_FAULTS, field)


def _require_sound(points: Points, faults: Sequence[Fault], field: str) -> None:
    found = first_fault(points, faults)
    if found is not None:
        raise InvalidInput(f"{field}.{found[1]}", found[0].reason, found[0].allowed)
