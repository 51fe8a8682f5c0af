"""An indicator diagram as a rod's load: p(V) of a two-stroke cycle, unrolled over the turn by ``solvers.crank``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.crank.indicator import STROKES, IndicatorCurve, IndicatorPressure
from solvers.crank.motion import ExactMotion
from solvers.crank.repair import Repair, repaired_indicator
from solvers.crank.scene import Cylinder
from solvers.errors import InvalidInput
from solvers.numerics.pieces import means
from solvers.rod.loads import TURN, require_back_pressure
from solvers.rod.scene import Mechanism, Piston

_MEAN_TOLERANCE = 1e-13
_RAMP = 1e-6
"""Within this of a dead centre [rad] a jump takes place, as a smooth step. The piston stands still there: what the ramp
takes from the limits on either side is of the order of its square, 1e-12."""


@dataclass(frozen=True)
class IndicatorLoad:
    """Pressures of one turn from an indicator diagram; behind the piston ``back_pressure`` [Pa], or the cycle's mean.

    The volume at an angle is V_c + pi D^2/4 x(phi), x that of the exact slider-crank. Where the pressures of the two
    strokes differ at a dead centre, the jump is a smooth step of 2e-6 rad about it. Raises InvalidInput, with the field
    under ``load``, for a diagram of four strokes (a flexible rod's cycle is one turn) and for points with a fault.
    """

    diagram: IndicatorPressure
    clearance_volume: float
    mechanism: Mechanism
    piston: Piston
    back_pressure: float | None = None

    def __post_init__(self) -> None:
        require_back_pressure(self.back_pressure)
        _require_one_turn(self.diagram)
        _ = self.curve

    @cached_property
    def curve(self) -> IndicatorCurve:
        """The diagram over the crank angle."""
        with fields_of_load():
            motion, cylinder = _machine(self.clearance_volume, self.mechanism, self.piston)
            return self.diagram.unroll(motion, cylinder)

    @cached_property
    def _steps(self) -> tuple[tuple[float, float, float], ...]:
        """(dead centre [rad], pressure before and behind the step) wherever there is one."""
        found = []
        for centre, jump in self.curve.jumps:
            before, behind = self.curve.pressure(centre + _RAMP * np.array([-1.0, 1.0]))
            if jump != 0.0:
                found.append((centre, float(before), float(behind)))
        return tuple(found)

    def pressure(self, angle: ArrayLike) -> NDArray[np.float64]:
        phi = np.asarray(angle, dtype=float)
        found = self.curve.pressure(phi)
        for centre, before, behind in self._steps:
            share = 0.5 + 0.5 * (np.mod(phi - centre + np.pi, TURN) - np.pi) / _RAMP
            inside = (share > 0.0) & (share < 1.0)
            found = np.where(inside, before + (behind - before) * share**2 * (3.0 - 2.0 * share), found)
        return found

    @cached_property
    def _mean(self) -> float:
        found = means(lambda a: self.curve.pressure(a)[None], self.curve.breaks, _MEAN_TOLERANCE)
        return float(found.value[0])

    def reference_pressure(self) -> float:
        return self._mean if self.back_pressure is None else self.back_pressure

    def sharp_angles(self) -> NDArray[np.float64]:
        """The diagram's points, the dead centres, and where their steps begin and end."""
        centres = np.array([centre for centre, _, _ in self._steps])
        return np.unique(np.mod(np.concatenate([self.curve.breaks, centres - _RAMP, centres + _RAMP]), TURN))


def mended(
    diagram: IndicatorPressure, clearance_volume: float, mechanism: Mechanism, piston: Piston
) -> tuple[IndicatorPressure, tuple[Repair, ...]]:
    """The diagram made sound for the machine, and what was done. Raises InvalidInput for what cannot be mended."""
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
    """Refusals of the crank's wing name its own fields; here they are the load's."""
    try:
        yield
    except InvalidInput as refusal:
        raise InvalidInput(_of_load(refusal.field), refusal.reason, refusal.allowed) from refusal
