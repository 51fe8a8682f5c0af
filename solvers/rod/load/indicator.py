"""Indicator diagram as a rod's load: p(V) of a two-stroke cycle, mapped to the crank angle by ``solvers.crank``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.crank.gas.cylinder import Cylinder
from solvers.crank.gas.data_repair import Repair, repaired_indicator
from solvers.crank.gas.indicator_diagram import STROKES, IndicatorPressure
from solvers.crank.gas.unrolled_pressure import Curve
from solvers.crank.motion.slider_crank import ExactMotion
from solvers.errors import InvalidInput
from solvers.numerics.panels import split
from solvers.rod.load.gas import TURN, require_back_pressure, sharpest
from solvers.rod.scene import Mechanism, Piston, PressureCurve

_RAMP = 1e-6
"""Half-width [rad] of the smooth step that replaces a jump at a dead centre. The piston is at rest there: the
approximation error is of the order of the square, 1e-12."""

_PIECES_PER_TURN = 4096
"""Cubic pieces per revolution: a cubic through four points of a piece has the error 5e-4 p'''' (2 pi/4096)^4 =
3e-15 p''''."""

_THROUGH_FOUR = 0.5 * np.array(
    [[-9.0, 27.0, -27.0, 9.0], [18.0, -45.0, 36.0, -9.0], [-11.0, 18.0, -9.0, 2.0], [2.0, 0.0, 0.0, 0.0]]
)
"""Matrix from values at 0, 1/3, 2/3, 1 to the coefficients of the interpolating cubic, highest power first."""


@dataclass(frozen=True)
class IndicatorLoad:
    """Pressures over one revolution from an indicator diagram; ``back_pressure`` [Pa], or the cycle's mean.

    The volume at an angle is V_c + pi D^2/4 x(phi), x that of the exact slider-crank. If the pressures of the two
    strokes differ at a dead centre, the jump is a smooth step of 2e-6 rad. Raises InvalidInput, with the field under
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
    def unrolled(self) -> Curve:
        """The diagram over the crank angle."""
        with fields_of_load():
            motion, cylinder = _machine(self.clearance_volume, self.mechanism, self.piston)
            return self.diagram.unroll(motion, cylinder)

    @cached_property
    def _curve(self) -> PressureCurve:
        """Cubics through four points per piece, with the diagram's points and additional ones as ends; the step at a
        dead centre is itself a cubic."""
        centres = np.array([centre for centre, _ in self.unrolled.jumps] + [TURN])
        points = self.unrolled.breaks
        away = np.min(np.abs(points[:, None] - centres), axis=1) > 2.0 * _RAMP
        ends = np.concatenate([points[away], centres[1:] - _RAMP, centres + _RAMP])
        ends = split(np.unique(ends), TURN / _PIECES_PER_TURN)
        low, width = ends[:-1], np.diff(ends)
        values = self.unrolled.pressure(low + width * np.arange(4)[:, None] / 3.0)
        values[3, :-1] = values[0, 1:]
        values[3, -1] = values[0, 0]
        pieces = _THROUGH_FOUR @ values
        step = np.min(np.abs(low + 0.5 * width - centres[:, None]), axis=0) < 0.5 * _RAMP
        before, rise = values[0, step], values[3, step] - values[0, step]
        pieces[:, step] = np.stack([-2.0 * rise, 3.0 * rise, 0.0 * rise, before])
        pieces /= width ** np.arange(3, -1, -1)[:, None]
        return PressureCurve(0.0, 0.0, 0.0, ends, np.ascontiguousarray(pieces))

    def curve(self) -> PressureCurve:
        return self._curve

    def pressure(self, angle: ArrayLike) -> NDArray[np.float64]:
        ends, pieces = self._curve.breaks, self._curve.pieces
        phi = ends[0] + np.mod(np.asarray(angle, dtype=float) - ends[0], TURN)
        piece = np.clip(np.searchsorted(ends, phi, side="right") - 1, 0, ends.size - 2)
        t = phi - ends[piece]
        return ((pieces[0, piece] * t + pieces[1, piece]) * t + pieces[2, piece]) * t + pieces[3, piece]

    @cached_property
    def _mean(self) -> float:
        width, powers = np.diff(self._curve.breaks), np.arange(4, 0, -1)[:, None]
        return float(np.sum(self._curve.pieces * width**powers / powers)) / TURN

    def reference_pressure(self) -> float:
        return self._mean if self.back_pressure is None else self.back_pressure

    def sharp_angles(self) -> NDArray[np.float64]:
        """The diagram's points, of very many the extreme ones, and the ends of the steps at dead centres."""
        centres = np.array([centre for centre, _ in self.unrolled.jumps])
        points = np.unique(np.mod(self.unrolled.breaks, TURN))
        points = sharpest(points, self.unrolled.pressure(points))
        return np.unique(np.mod(np.concatenate([points, centres - _RAMP, centres + _RAMP]), TURN))


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
