"""Many pins checked at once: the same numbers as ``check`` gives one by one.

Stepped bores under the rod's force alone go through one compiled loop; other bores, further load cases, and pins with a
limit on the slope are checked one by one.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, Choice, EffectSelection
from solvers.errors import InvalidInput
from solvers.outcome import Accuracy, Outcome, Status
from solvers.pin.bulk.closed_form import Pins, Results
from solvers.pin.bulk.constant import lightest_share
from solvers.pin.bulk.table import demand_rows, evaluated, law_row
from solvers.pin.check import PinCheck, RingResult, check, exceeded, ring_of, ring_warnings, shape_warnings
from solvers.pin.effects import Physics, PinEffect, choose_for, compose, demands_of
from solvers.pin.limits import NO_LIMITS, Limits
from solvers.pin.load.macaulay import ROUNDING
from solvers.pin.optimum.bore_sought import BoreSought
from solvers.pin.optimum.capacity import force_limit
from solvers.pin.ring.bearing_pressure import pressures_of_pin
from solvers.pin.scene import BushingGeometry, Scene
from solvers.pin.section.criteria import CRITERIA, Criterion
from solvers.pin.section.flexibility import cowper
from solvers.pin.shapes.given import Profile

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """One check as ``check`` would be asked for it."""

    scene: Scene
    profile: Profile
    criterion: Criterion = CRITERIA["tresca_paper"]
    limits: Limits = NO_LIMITS
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6

    def alone(self) -> Outcome[PinCheck]:
        """The single check."""
        return check(
            self.scene, self.profile, self.criterion, self.limits, self.effects, self.effect_tolerance, self.accuracy
        )


@dataclass(frozen=True)
class Steps:
    """A stepped bore: diameters of the steps of the first half, and where each of them ends [m]."""

    ends: tuple[float, ...]
    bores: tuple[float, ...]


def steps_of(profile: Profile, length: float) -> Steps | None:
    """A profile's steps, if it has nothing else and its points stand for both halves; else None."""
    half, bore = 0.5 * length, profile.bore
    if all(d == bore[0] for d in bore):
        return Steps((half,), bore[:1])
    if profile.x[-1] > half * (1.0 + 1e-12):
        return None
    # Before the first point and behind the last one the bore goes on unchanged.
    places = [0.0, *profile.x, half]
    diameters = [bore[0], *bore, bore[-1]]
    ends, bores = [], []
    for (start, ahead), (end, behind) in pairwise(zip(places, diameters, strict=True)):
        if start < min(end, half):
            if ahead != behind:
                return None
            ends.append(min(end, half))
            bores.append(ahead)
    return Steps(tuple(ends), tuple(bores))


def check_many(cases: Iterable[Case]) -> list[Outcome[PinCheck] | InvalidInput]:
    """An outcome for every case, in their order; in the place of one that makes no sense, what is wrong with it.

    Stepped bores have no ``along``.
    """
    cases = list(cases)
    found: list[Outcome[PinCheck] | InvalidInput | None] = [None] * len(cases)
    asked: list[_Asked] = []
    for k, case in enumerate(cases):
        try:
            given = _asked(k, case)
            if given is None:
                found[k] = case.alone()
            else:
                asked.append(given)
        except InvalidInput as refusal:
            found[k] = refusal
    began = time.perf_counter()
    results = _evaluated(asked)
    share = (time.perf_counter() - began) / max(len(asked), 1)
    for row, given in enumerate(asked):
        try:
            found[given.place] = _outcome(given, results, row, share)
        except InvalidInput as refusal:
            found[given.place] = refusal
    return found  # type: ignore[return-value]


@dataclass(frozen=True)
class _Asked:
    """A case that the loop takes: its place in the list, its steps, and its physics."""

    place: int
    case: Case
    steps: Steps
    choice: Choice[PinEffect]
    physics: Physics


def _asked(place: int, case: Case) -> _Asked | None:
    """A case as the loop takes it; None where it does not. Raises InvalidInput as ``check`` does."""
    g = case.scene.geometry
    alone = not case.scene.symmetric or isinstance(g, BushingGeometry)
    steps = None if alone or case.limits.max_slope is not None else steps_of(case.profile, g.length)
    if steps is None:
        return None
    require_accuracy(case.accuracy)
    case.profile.require_inside(g)
    choice = choose_for(case.scene, case.effects, case.effect_tolerance, demands_of(case.limits))
    return _Asked(place, case, steps, choice, compose(choice))


def _evaluated(asked: Sequence[_Asked]) -> Results:
    """The loop's results, a row for each; where steps are fewer than others', the last one is repeated."""
    most = max((len(given.steps.ends) for given in asked), default=1)
    ends, bores = np.empty((len(asked), most)), np.empty((len(asked), most))
    sizes, elastic = np.empty((len(asked), 5)), np.empty((len(asked), 4))
    demands, laws = np.empty((len(asked), 3, 3)), np.empty((len(asked), 3))
    for k, given in enumerate(asked):
        g, m, steps, own = given.case.scene.geometry, given.case.scene.material, given.steps, given.case.criterion
        short = most - len(steps.ends)
        ends[k], bores[k] = steps.ends + steps.ends[-1:] * short, steps.bores + steps.bores[-1:] * short
        sizes[k] = g.outer_diameter, g.boss_length, g.small_end_length, g.gap, given.case.scene.force
        law, shears = cowper(m.poisson), float(given.physics.shear_deflection)
        elastic[k] = m.elastic_modulus, m.shear_modulus, shears * law.a, shears * law.b
        demands[k], laws[k] = demand_rows(own, m), law_row(own, m)
    return evaluated(Pins(sizes, elastic, demands, laws), ends, np.maximum(sizes[:, :1] - bores, 0.0) / sizes[:, :1])


def _outcome(given: _Asked, results: Results, row: int, seconds: float) -> Outcome[PinCheck]:
    """One row as ``check`` answers it."""
    scene, limits, criterion, bores = given.case.scene, given.case.limits, given.case.criterion, given.steps.bores
    g, m = scene.geometry, scene.material
    found = Results(*(float(column[row]) for column in results))
    use, deflection = max(found.criterion, found.shear), found.deflection
    constant = lightest_share(scene, limits, criterion, given.physics.shear_deflection)
    sizes = np.array(bores)
    ring = ring_of(scene, BoreSought(g.outer_diameter), sizes) if given.physics.ovalization else None
    solid_mass = m.density * g.area * g.length
    value = PinCheck(
        mass=solid_mass * found.volume,
        solid_mass=solid_mass,
        constant_mass=None if constant is None else solid_mass * constant,
        sections=None,
        min_bore=min(bores),
        bore_mid=bores[-1],
        max_outer=g.outer_diameter,
        outer_mid=g.outer_diameter,
        least_wall=0.5 * max(g.outer_diameter - max(bores), 0.0),
        max_moment=found.moment,
        max_shear=found.force,
        equivalent_stress_max=_finite(m.allowable_stress * found.criterion),
        worst_section=found.worst,
        shear_stress_max=None if m.allowable_shear is None else _finite(m.allowable_shear * found.shear),
        strength_utilisation=_finite(use),
        deflection=_finite(deflection),
        ring=ring,
        pressures=pressures_of_pin(scene) if given.physics.contact_pressure else None,
        force_limit=scene.force / found.solid if scene.force > 0.0 else force_limit(scene, criterion),
        warnings=_warnings(given, found, ring),
    )
    accuracy = Accuracy(given.case.accuracy, ROUNDING, {"sections": len(bores)})
    return Outcome(Status.SUCCEEDED, value, given.choice.manifest, accuracy, timing={"solve_s": seconds})


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _warnings(given: _Asked, found: Results, ring: RingResult | None) -> tuple[str, ...]:
    """What the pin breaks, as ``check`` says it."""
    scene, limits, steps, said = given.case.scene, given.case.limits, given.steps, []
    outer, use = scene.geometry.outer_diameter, max(found.criterion, found.shear)
    if use > 1.0 + 1e-9:
        said.append(exceeded(np.array([found.first_over, found.last_over]), use))
    walls = np.maximum(outer - np.array(steps.bores), 0.0)
    said += shape_warnings(limits, 0.5 * float(walls.min()), found.deflection)
    if ring is not None:
        x = np.stack([(0.0, *steps.ends[:-1]), steps.ends], axis=1).ravel()
        said += ring_warnings(scene, BoreSought(outer), limits, x, np.repeat(walls / outer, 2), ring)
    return tuple(said)
