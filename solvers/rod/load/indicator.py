"""Indicator diagram as a rod's load: p(V) of a two-stroke cycle, mapped to the crank angle by ``solvers.crank``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.crank.gas.data_faults import Repair
from solvers.crank.gas.indicator_diagram import STROKES, IndicatorPressure, repaired_indicator
from solvers.crank.gas.unrolled_pressure import Cylinder, Unrolled
from solvers.crank.motion.slider_crank import ExactMotion
from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array
from solvers.numerics.panels import split
from solvers.numerics.periodic import TURN, distances
from solvers.rod.load.gas import require_back_pressure, sharpest
from solvers.rod.scene import JUMP, Load, Mechanism, Piston, PressureCurve

_WIDEST, _CLOSE, _MOST_HALVINGS = TURN / 64, 3e-12, 12
"""Resolution of the curve: maximum width of its initial pieces [rad], the error between the interpolation points of a
cubic, relative to the maximum pressure, above which a piece is halved, and the maximum number of halvings."""

_THROUGH_FOUR = 0.5 * np.array(
    [[-9.0, 27.0, -27.0, 9.0], [18.0, -45.0, 36.0, -9.0], [-11.0, 18.0, -9.0, 2.0], [2.0, 0.0, 0.0, 0.0]]
)
"""Matrix from values at 0, 1/3, 2/3, 1 to the coefficients of the interpolating cubic, highest power first."""


@dataclass(frozen=True)
class IndicatorLoad(Load):
    """Pressures over one revolution from an indicator diagram; ``back_pressure`` [Pa], or the cycle's mean.

    The volume at an angle is V_c + pi D^2/4 x(phi), x that of the exact slider-crank. If the pressures of the two
    strokes differ at a dead centre, the jump is a smooth step of 2e-6 rad; the piston is at rest there, so the error is
    of the order of the square, 1e-12. Raises InvalidInput, with the field under
    ``load``, for a four-stroke diagram (a flexible rod's cycle is one revolution) and for invalid points.
    """

    diagram: IndicatorPressure
    clearance_volume: float
    mechanism: Mechanism
    piston: Piston
    back_pressure: float | None = None

    def __post_init__(self) -> None:
        require_back_pressure(self.back_pressure)
        _require_one_turn(self.diagram)
        _ = self.unrolled

    @cached_property
    def unrolled(self) -> Unrolled:
        """The diagram over the crank angle."""
        with fields_of_load():
            motion, cylinder = _machine(self.clearance_volume, self.mechanism, self.piston)
            return self.diagram.unroll(motion, cylinder)

    @cached_property
    def curve(self) -> PressureCurve:
        """Cubics through four points per piece, with the diagram's points and additional ones as ends; the step at a
        dead centre is itself a cubic, of two pieces."""
        centres = np.append(self.jumps(), TURN)
        points = self.unrolled.breaks
        away = np.min(np.abs(points[:, None] - centres), axis=1) > 2.0 * JUMP
        ends = np.concatenate([points[away], centres[1:] - JUMP, centres[1:], centres + JUMP])
        ends = split(np.unique(ends), _WIDEST)
        for _ in range(_MOST_HALVINGS):
            _, values, missed = self._cubics(ends)
            far = (missed > _CLOSE * np.abs(values).max()) & (np.diff(ends) > 2.0 * JUMP)
            if not far.any():
                break
            ends = np.sort(np.concatenate([ends, (0.5 * (ends[1:] + ends[:-1]))[far]]))
        pieces, values, _ = self._cubics(ends)
        rising = np.flatnonzero(np.isin(ends[1:-1], centres))
        before, rise = values[0, rising], values[3, rising + 1] - values[0, rising]
        none = np.zeros_like(rise)
        pieces[:, rising] = np.stack([-0.25 * rise, 0.75 * rise, none, before])
        pieces[:, rising + 1] = np.stack([-0.25 * rise, none, 0.75 * rise, before + 0.5 * rise])
        pieces /= np.diff(ends) ** np.arange(3, -1, -1)[:, None]
        return PressureCurve(0.0, 0.0, 0.0, ends, np.ascontiguousarray(pieces))

    def _cubics(self, ends: Array) -> tuple[Array, ...]:
        """Interpolating cubics of all pieces.

        Coefficients in the fraction of the piece, highest power first, (4, pieces); the pressures at their four points,
        (4, pieces); and the largest interpolation error midway between these, (pieces,).
        """
        low, width = ends[:-1], np.diff(ends)
        values = self.unrolled.pressure(low + width * np.arange(7)[:, None] / 6.0)
        values[6, :-1] = values[0, 1:]
        values[6, -1] = values[0, 0]
        pieces = _THROUGH_FOUR @ values[::2]
        missed = np.vander(np.array([1.0, 3.0, 5.0]) / 6.0, 4) @ pieces - values[1::2]
        return pieces, values[::2], np.abs(missed).max(axis=0)

    def corners(self) -> Array:
        points, centres = np.mod(self.unrolled.breaks, TURN), self.jumps()
        apart = distances(points, centres).min(axis=1, initial=TURN) > 2.0 * JUMP
        return np.unique(np.concatenate([points[apart], centres]))

    def jumps(self) -> Array:
        return np.array([centre for centre, _ in self.unrolled.jumps])

    @cached_property
    def default_back_pressure(self) -> float:
        width, powers = np.diff(self.curve.breaks), np.arange(4, 0, -1)[:, None]
        return float(np.sum(self.curve.pieces * width**powers / powers)) / TURN

    def sharp_angles(self) -> Array:
        """The diagram's points (of a very long one only the extreme points) and the ends of the steps at the dead
        centres."""
        centres, points = self.jumps(), np.unique(np.mod(self.unrolled.breaks, TURN))
        points = sharpest(points, self.unrolled.pressure(points))
        return np.unique(np.mod(np.concatenate([points, centres - JUMP, centres + JUMP]), TURN))


def mended(
    diagram: IndicatorPressure, clearance_volume: float, mechanism: Mechanism, piston: Piston
) -> tuple[IndicatorPressure, tuple[Repair, ...]]:
    """The diagram repaired for the machine, and the repairs. Raises InvalidInput for an irreparable diagram."""
    _require_one_turn(diagram)
    with fields_of_load():
        motion, cylinder = _machine(clearance_volume, mechanism, piston)
        sound, repairs = repaired_indicator(diagram, cylinder, motion)
    return sound, tuple(Repair(_of_load(r.field), r.what) for r in repairs)


def _machine(clearance_volume: float, mechanism: Mechanism, piston: Piston) -> tuple[ExactMotion, Cylinder]:
    motion = ExactMotion(mechanism.crank_radius, mechanism.rod_length)
    return motion, Cylinder(piston.diameter, clearance_volume, 0.0, strokes=2)


def _require_one_turn(diagram: IndicatorPressure) -> None:
    if len(diagram.strokes) != len(STROKES[2]):
        raise InvalidInput(
            "load.strokes",
            f"has {len(diagram.strokes)} strokes; a flexible rod's cycle is one turn, so its diagram has two",
            ", ".join(STROKES[2]),
        )


def _of_load(field: str) -> str:
    return f"load.{field.partition('.')[2]}"


@contextmanager
def fields_of_load() -> Iterator[None]:
    """Map field names of InvalidInput raised by ``solvers.crank`` to those of the load."""
    try:
        yield
    except InvalidInput as refusal:
        raise InvalidInput(_of_load(refusal.field), refusal.reason, refusal.allowed) from refusal
