"""Vibration under a load with many corners, fast and rough: for searches, whose results are checked exactly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solvers.numerics.panels import split
from solvers.numerics.radau import radau
from solvers.numerics.threads import one_thread
from solvers.rod.cycle.composition import Cycle
from solvers.rod.cycle.state import FORCE
from solvers.rod.vibration.adiabatic_motion import adiabatic_motion
from solvers.rod.vibration.equation import StripEquation
from solvers.rod.vibration.excitation import FEW_CORNERS, Excitation
from solvers.rod.vibration.motion import Motion
from solvers.rod.vibration.steady_response import RodInertia, SteadyVibration

_RULES = ((0.5, radau(3)), (1.7, radau(4)), (2.5, radau(5)))
"""Rules of elements, each with the angle [rad] over which the first mode may turn in one."""
_POLYNOMIALS = 7
"""Number of polynomials along the strip; with more the error stays the same, with 5 it is four times as large."""
_NARROWEST = 1e-5
"""Width of elements [rad] below which derivatives of polynomials on them lose too many digits."""
_MOST_ELEMENTS, _MOST_PER_CORNER = 1000, 4
"""Numbers of elements, in all and per corner, from both of which on exact motions take less time: there no mode is
followed in time."""


@dataclass(frozen=True)
class AdiabaticRodInertia(RodInertia):
    """``RodInertia`` in adiabatic modes (``adiabatic_motion``) where these are valid and quicker, otherwise the same as
    that."""

    def prepare(self, cycle: Cycle) -> SteadyVibration:
        with one_thread():
            found = _vibration(cycle)
        return super().prepare(cycle) if found is None else found

    def neighbours(self, found: SteadyVibration, cycles: Sequence[Cycle]) -> list[SteadyVibration | None]:
        if all(found.motion.rule is not rule for _, rule in _RULES):
            return super().neighbours(found, cycles)
        with one_thread():
            return [_vibration(cycle, found.motion) for cycle in cycles]


def _vibration(cycle: Cycle, resolved: Motion | None = None) -> SteadyVibration | None:
    """The vibration, at the resolution of a neighbouring strip's motion if one is given; None where the method is not
    valid, or slow."""
    rule = _RULES[0][1] if resolved is None else resolved.rule
    excitation = Excitation.of(cycle, math.inf, rule)
    is_valid = excitation.corners.size > FEW_CORNERS and not excitation.jumps.size
    if not is_valid or np.min(np.diff(excitation.edges)) < _NARROWEST:
        return None
    strip, loss = excitation.strip, cycle.scene.material.loss_factor
    equation = StripEquation.of(strip, excitation.inertia, excitation.mean, _POLYNOMIALS, loss)
    greatest = excitation.states[FORCE].reshape(-1, rule.points.size).max(axis=1)
    frequency = equation.frequency_of(1, strip.couples * greatest - equation.mean)
    edges = split(excitation.edges, _RULES[-1][0] / frequency)
    if resolved is None:
        if edges.size > max(_MOST_ELEMENTS, _MOST_PER_CORNER * excitation.corners.size):
            return None
        greatest_turn = frequency.max() * np.diff(edges).max()
        rule = next((rule for turn, rule in _RULES if greatest_turn <= turn), _RULES[-1][1])
        if rule is not excitation.rule:
            excitation = Excitation.of(cycle, math.inf, rule)
    motion = adiabatic_motion(equation, excitation, edges, cycle.tolerance, resolved)
    return SteadyVibration(motion, motion.errors.total, motion.errors.total, excitation, coherent=False)
