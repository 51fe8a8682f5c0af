"""Faults of indicator data: detection, the offending point, and the repair."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array

Offending = NDArray[np.bool_]

REVOLUTION = 2.0 * math.pi
END_GAP = 5e-3
"""Fraction of the swept volume by which a stroke's points may miss a dead centre; the end's pressure is extended."""

_RADIANS_PER_DEGREE = math.pi / 180.0
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

    def select(self, kept: Array) -> Points:
        return replace(self, x=self.x[kept], pressure=self.pressure[kept])


class Fault:
    """A kind of data fault; without a ``repair`` it is irreparable."""

    reason: str
    allowed: str
    repair: str = ""

    def offending(self, points: Points) -> Offending:
        """Return a mask of the points that have the fault, (n,)."""
        raise NotImplementedError

    def repaired(self, points: Points) -> Points:
        """Return the points with the fault repaired; by default, without the offending points."""
        return points.select(~self.offending(points))


def _last(points: Points, offends: bool) -> Offending:
    """Mask of the last point if ``offends``, otherwise of none."""
    return np.append(np.zeros(points.x.size - 1, bool), offends)


class Radians(Fault):
    reason = "the angles span 2 pi or 4 pi degrees: they look like radians"
    allowed = "degrees over the whole cycle"
    repair = "angles taken as radians"

    def offending(self, points: Points) -> Offending:
        return _last(points, 0.8 * REVOLUTION <= np.ptp(points.x) / _RADIANS_PER_DEGREE <= 1.001 * points.span)

    def repaired(self, points: Points) -> Points:
        return replace(points, x=points.x / _RADIANS_PER_DEGREE)


class RestartedAngles(Fault):
    """The angles restart at zero in the second revolution of a four-stroke cycle."""

    reason = "the angle starts again: the second turn of the cycle is labelled like the first"
    allowed = "rising angles over two turns"
    repair = "a turn added to the angles from this point on"

    def offending(self, points: Points) -> Offending:
        """Return a mask of the points of the second revolution."""
        steps = np.diff(points.x, prepend=points.x[0])
        one_revolution_labelled = points.span >= 1.5 * REVOLUTION and np.ptp(points.x) <= 1.01 * REVOLUTION
        restarted = one_revolution_labelled and np.sum(steps < 0) == 1 and steps.min() < -0.75 * REVOLUTION
        return np.logical_or.accumulate(steps < 0) & restarted

    def repaired(self, points: Points) -> Points:
        return replace(points, x=points.x + np.where(self.offending(points), REVOLUTION, 0.0))


class TwoRevolutionsAsOne(Fault):
    """Two revolutions given as one."""

    reason = "the angles of a four-stroke cycle end after one turn: two turns labelled as one, or half the data"
    allowed = "angles over two turns, or strokes 2"
    repair = "all angles doubled"

    def offending(self, points: Points) -> Offending:
        return _last(
            points, points.span > 1.5 * REVOLUTION and 0.8 * REVOLUTION <= np.ptp(points.x) <= 1.001 * REVOLUTION
        )

    def repaired(self, points: Points) -> Points:
        return replace(points, x=points.x[0] + 2.0 * (points.x - points.x[0]))


class Unsorted(Fault):
    reason = "does not follow the point before it"
    allowed = "points in order"
    repair = "points sorted"

    def offending(self, points: Points) -> Offending:
        return np.diff(points.x, prepend=points.x[0]) < 0

    def repaired(self, points: Points) -> Points:
        return points.select(np.argsort(points.x, kind="stable"))


class NotMonotone(Unsorted):
    """The volume is not monotone along a stroke."""

    reason = "the volume turns back within the stroke"
    allowed = "volumes that only rise or only fall"
    repair = "points sorted by volume"

    def offending(self, points: Points) -> Offending:
        steps = np.diff(points.x, prepend=points.x[0])
        return steps < 0 if np.sum(steps > 0) >= np.sum(steps < 0) else steps > 0


class Repeated(Fault):
    reason = "repeats an earlier point"
    allowed = "one pressure for each place"
    repair = "repeated points replaced by their mean"

    def offending(self, points: Points) -> Offending:
        return np.abs(np.diff(points.x, prepend=-np.inf)) <= 1e-12 * points.span

    def repaired(self, points: Points) -> Points:
        order = np.argsort(points.x, kind="stable")
        x, pressure = points.x[order], points.pressure[order]
        first = np.diff(x, prepend=-np.inf) > 1e-12 * points.span
        group = np.cumsum(first) - 1
        return replace(points, x=x[first], pressure=np.bincount(group, pressure) / np.bincount(group))


class NotClosed(Fault):
    reason = "lies one cycle after the first point, with another pressure: the cycle is not closed"
    allowed = "the first point's pressure, or no such point"
    repair = "first and last point replaced by their mean"

    def offending(self, points: Points) -> Offending:
        repeats_first = abs(points.x[-1] - points.x[0] - points.span) <= 1e-9 * points.span
        gap = abs(points.pressure[-1] - points.pressure[0])
        return _last(points, repeats_first and gap > _CLOSURE_TOLERANCE * np.ptp(points.pressure))

    def repaired(self, points: Points) -> Points:
        closed = points.pressure.copy()
        closed[0] = closed[-1] = 0.5 * (closed[0] + closed[-1])
        return replace(points, pressure=closed)


class LongerThanCycle(Fault):
    reason = "lies more than one cycle after the first"
    allowed = "one cycle: one turn for two strokes, two turns for four"
    repair = "points beyond one cycle left out"

    def offending(self, points: Points) -> Offending:
        return points.x - points.x[0] > points.span * (1.0 + 1e-9)


class LargeGap(Fault):
    """More than half a cycle without a point, which cannot be interpolated or repaired."""

    reason = "more than half of the cycle after this point holds no other"
    allowed = "points all over the cycle"

    def offending(self, points: Points) -> Offending:
        return np.diff(points.x, append=points.x[0] + points.span) > 0.5 * points.span


class OutsideVolumeRange(Fault):
    reason = "lies outside the volumes of the cylinder (clearance volume, bore and crank radius tell them)"
    allowed = "between the clearance volume and it plus the swept volume"
    repair = "points outside the cylinder's volumes left out"

    def offending(self, points: Points) -> Offending:
        tolerance = END_GAP * points.span
        return (points.x < points.low - tolerance) | (points.x > points.high + tolerance)


class MissingDeadCentre(Fault):
    reason = "is the last before a dead centre that the points do not reach"
    allowed = "points from the clearance volume to it plus the swept volume"
    repair = "pressure held to the dead centre"

    def _missing_ends(self, points: Points) -> list[tuple[int, float]]:
        """Return, for each dead centre that the data do not reach, the index of the nearest point and the volume."""
        tolerance, low, high = END_GAP * points.span, int(np.argmin(points.x)), int(np.argmax(points.x))
        found = [(low, points.low)] if points.x[low] > points.low + tolerance else []
        return [*found, (high, points.high)] if points.x[high] < points.high - tolerance else found

    def offending(self, points: Points) -> Offending:
        return np.isin(np.arange(points.x.size), [last for last, _ in self._missing_ends(points)])

    def repaired(self, points: Points) -> Points:
        for last, end in self._missing_ends(points):
            points = Points(
                np.append(points.x, end), np.append(points.pressure, points.pressure[last]), points.low, points.high
            )
        return points.select(np.argsort(points.x, kind="stable"))


TABLE_FAULTS: tuple[Fault, ...] = (
    Radians(),
    RestartedAngles(),
    Unsorted(),
    Repeated(),
    TwoRevolutionsAsOne(),
    LongerThanCycle(),
    NotClosed(),
    LargeGap(),
)
STROKE_FAULTS: tuple[Fault, ...] = (OutsideVolumeRange(), NotMonotone(), Repeated(), MissingDeadCentre())


def first_fault(points: Points, faults: Sequence[Fault]) -> tuple[Fault, int] | None:
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
    found = first_fault(points, faults)
    if found is not None:
        raise InvalidInput(f"{field}.{found[1]}", found[0].reason, found[0].allowed)
