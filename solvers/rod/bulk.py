"""Batch evaluation of many strips, with the same results as ``check``.

Effects are selected for every case individually. Cases without shape corrections - all effects but the strip's own
inertia and large displacement - go through one compiled loop (``solvers.rod.linear_check``), the same as in the single
check; the others go through ``check``.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, Choice, Demand, EffectSelection
from solvers.errors import InvalidInput
from solvers.fatigue import FatigueCriterion, serensen
from solvers.fatigue.kernels import Diagram
from solvers.numerics.parallel import in_slices
from solvers.outcome import Outcome
from solvers.rod.check import RodCheck, check, outcome_of, require_within_rod
from solvers.rod.cycle.composition import Composition
from solvers.rod.cycle.sampling import rule_for
from solvers.rod.effects import RodEffect, choose_for, compose
from solvers.rod.linear_check import INPUTS, Results, check_linear, inputs_of, stations_for
from solvers.rod.piston.skirt import pressure_per_load
from solvers.rod.scene import Dimensions, Load, Scene

Array = NDArray[np.float64]

_SIZES = slice(INPUTS.index("b"), INPUTS.index("l") + 1)


class Case(NamedTuple):
    """Arguments of one call of ``check``."""

    scene: Scene
    dimensions: Dimensions
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6
    criterion: FatigueCriterion | None = None
    demands: tuple[Demand, ...] = ()

    def evaluate(self) -> Outcome[RodCheck]:
        """Evaluate this case by ``check``."""
        return check(
            self.scene, self.dimensions, self.effects, self.effect_tolerance, self.accuracy, self.criterion,
            self.demands,
        )  # fmt: skip


@dataclass(frozen=True)
class RodTable:
    """Results of many strips in one machine, SI units, (n,) each; NaN where a result does not exist.

    ``utilisation`` is the inverse of the fatigue safety, ``stability`` P_cr over the maximum compression, inf if there
    is none; ``estimated`` the maximum relative numerical error.
    """

    utilisation: Array
    stability: Array
    greatest_stress: Array
    stress_amplitude: Array
    stress_mean: Array
    worst_section: Array
    side_force_max: Array
    clamp_moment_max: Array
    deflection: Array
    contact_pressure_max: Array
    friction_power: Array
    critical_force: Array
    natural_frequency: Array
    mass: Array
    estimated: Array


def check_many(cases: Iterable[Case]) -> list[Outcome[RodCheck] | InvalidInput]:
    """Outcomes of all cases, in order; for an invalid case its InvalidInput."""
    cases = list(cases)
    found: list[Outcome[RodCheck] | InvalidInput | None] = [None] * len(cases)
    choices: dict[int, Choice[RodEffect]] = {}
    criteria: dict[int, FatigueCriterion] = {}
    groups: dict[object, list[int]] = {}
    inputs, diagrams = np.empty((len(cases), len(INPUTS))), {}
    started = time.perf_counter()
    for i, case in enumerate(cases):
        scene, accuracy = case.scene, case.accuracy
        try:
            require_accuracy(accuracy)
            require_within_rod(scene, case.dimensions)
            choice = choose_for(scene, case.dimensions, case.effects, case.effect_tolerance, case.demands)
        except InvalidInput as refusal:
            found[i] = refusal
            continue
        composition = compose(choice)
        if composition.corrections:
            continue
        criteria[i], choices[i] = case.criterion or serensen(scene.material), choice
        diagrams[i] = criteria[i].diagram()
        inputs[i] = inputs_of(scene, case.dimensions, composition, choice.has("friction"), accuracy)
        resolution = rule_for(scene.load, accuracy).points.size, stations_for(accuracy)
        groups.setdefault((_grouping_key(scene.load), diagrams[i].lines.shape, resolution), []).append(i)
    for members in groups.values():
        first = cases[members[0]]
        results = _check_rows(first.scene.load, inputs[members], [diagrams[i] for i in members], first.accuracy)
        share = (time.perf_counter() - started) / len(cases)
        for i, row in zip(members, results.tolist(), strict=True):
            case = cases[i]
            found[i] = outcome_of(
                case.scene, case.dimensions, choices[i], criteria[i], case.accuracy, Results(*row), share
            )
    return [_check_single(case) if outcome is None else outcome for case, outcome in zip(cases, found, strict=True)]


def check_strips(
    scene: Scene,
    dimensions: Array,
    composition: Composition,
    contact: bool = False,
    accuracy: float = 1e-6,
    criterion: FatigueCriterion | None = None,
    threads: int = 1,
) -> RodTable:
    """Evaluate strips of dimensions b, h, l [m], shape (n, 3), in one machine with a given composition.

    ``contact`` requests contact pressure and friction power. The strips are divided among threads, which release the
    GIL. Raises InvalidInput for an invalid strip, and ValueError for a composition with corrections.
    """
    require_accuracy(accuracy)
    if composition.corrections:
        raise ValueError("corrections of the shape have no form for many strips: use check")
    dimensions = np.ascontiguousarray(dimensions, dtype=float).reshape(-1, 3)
    for b, h, l in dimensions[~_is_valid(dimensions, scene)][:1]:
        require_within_rod(scene, Dimensions(b, h, l))
    diagram = (criterion or serensen(scene.material)).diagram()
    any_strip = Dimensions(1.0, 1.0, 1.0)
    inputs = np.tile(inputs_of(scene, any_strip, composition, contact, accuracy), (len(dimensions), 1))
    inputs[:, _SIZES] = dimensions
    return _table(scene, dimensions, _check_rows(scene.load, inputs, [diagram] * len(dimensions), accuracy, threads))


def _is_valid(dimensions: Array, scene: Scene) -> NDArray[np.bool_]:
    valid = np.isfinite(dimensions).all(axis=1) & (dimensions > 0.0).all(axis=1)
    return valid & (dimensions[:, 2] <= scene.mechanism.rod_length)


def _grouping_key(load: Load) -> object:
    """Grouping key of loads that the compiled loop can process together: all smooth ones; any other by itself."""
    return None if not load.curve().breaks.size and not load.sharp_angles().size else id(load)


def _check_rows(load: Load, inputs: Array, diagrams: Sequence[Diagram], accuracy: float, threads: int = 1) -> Array:
    """Results (n, results) of inputs with the same load pieces and the same sampling rule."""
    results, rule = np.empty((len(inputs), len(Results._fields))), rule_for(load, accuracy)
    stations = stations_for(accuracy)
    if not len(inputs):
        return results
    lines = np.stack([diagram.lines for diagram in diagrams])
    parabolas = np.stack([diagram.parabola for diagram in diagrams])

    def check(part: slice) -> None:
        check_linear(load, inputs[part], lines[part], parabolas[part], rule, stations, results[part])

    in_slices(check, len(inputs), threads)
    return results


def _check_single(case: Case) -> Outcome[RodCheck] | InvalidInput:
    try:
        return case.evaluate()
    except InvalidInput as refusal:
        return refusal


def _table(scene: Scene, dimensions: Array, results: Array) -> RodTable:
    found = Results(*np.ascontiguousarray(results.T))
    with np.errstate(divide="ignore", invalid="ignore"):
        stability = np.where(found.compression > 0.0, found.critical_force / found.compression, np.inf)
    return RodTable(
        utilisation=found.utilisation,
        stability=stability,
        greatest_stress=found.max_stress,
        stress_amplitude=0.5 * (found.high - found.low),
        stress_mean=0.5 * (found.high + found.low),
        worst_section=found.section,
        side_force_max=found.side,
        clamp_moment_max=found.moment,
        deflection=found.deflection,
        contact_pressure_max=found.contact_load * pressure_per_load(scene.piston.diameter, scene.piston.skirt_length),
        friction_power=found.power,
        critical_force=found.critical_force,
        natural_frequency=found.natural_frequency,
        mass=scene.material.density * dimensions.prod(axis=1),
        estimated=found.error,
    )
