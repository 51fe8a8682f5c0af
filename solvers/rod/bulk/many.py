"""Many strips checked at once: the same numbers as ``check`` gives one by one.

Effects are chosen for every case by itself. What has no corrections of its shape - all but the strip's own inertia and
large displacement - then goes through one compiled loop (``loop``); the rest, strips at their stability boundary and
turns that ask for many panels go through ``check``.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, Choice, Demand, EffectSelection
from solvers.errors import InvalidInput
from solvers.fatigue import FatigueCriterion, serensen
from solvers.fatigue.kernels import GREATEST, Diagram
from solvers.numerics.panels import Rule, rule_of
from solvers.outcome import Accuracy, Outcome, Status
from solvers.rod.bulk.loop import COLUMNS, LEFT, RESULTS, TURN_ALONE, WHOLE, check_rows
from solvers.rod.bulk.turn import MOST_PANELS
from solvers.rod.check import RodCheck, Stresses, check, require_within_rod, warnings_of
from solvers.rod.cycle.composition import Composition
from solvers.rod.cycle.sampled import NO_RINGING, panel_edges
from solvers.rod.cycle.section import DEFLECTION, FIBRES, STATIONS, Field, station_table, worst
from solvers.rod.cycle.state import ROWS, SIDE, Strip
from solvers.rod.effects import RodEffect, choose_for, compose
from solvers.rod.load.axial_force import Drive
from solvers.rod.piston.skirt import pressure_per_load
from solvers.rod.scene import Dimensions, Load, PressureCurve, Scene
from solvers.rod.strip.buckling import critical_force
from solvers.rod.strip.stiffness import SHEAR_FACTOR
from solvers.rod.vibration.natural_frequencies import energies

Array = NDArray[np.float64]

_AT = {name: column for column, name in enumerate(RESULTS)}
_BENDING = [COLUMNS.index(name) for name in ("couples", "shears")]
_FEEDBACK, _RUBS = (COLUMNS.index(name) for name in ("feedback", "friction_coefficient"))
_SHARE = 0.1
_POINTS, _CHUNK = 16, 256
"""Of a panel, and strips whose turns are kept at a time."""


@dataclass(frozen=True)
class Case:
    """One check as ``check`` would be asked for it."""

    scene: Scene
    dimensions: Dimensions
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6
    criterion: FatigueCriterion | None = None
    demands: tuple[Demand, ...] = ()

    def alone(self) -> Outcome[RodCheck]:
        """The single check."""
        return check(
            self.scene, self.dimensions, self.effects, self.effect_tolerance, self.accuracy, self.criterion,
            self.demands,
        )  # fmt: skip


@dataclass(frozen=True)
class RodTable:
    """Results of many strips in one machine, SI units, (n,) each; NaN where a result does not exist.

    ``utilisation`` is the inverse of the fatigue safety, ``stability`` P_cr over the greatest compression, inf without
    any; ``estimated`` the greatest relative numerical error; ``alone`` tells the strips that the loop left to
    ``check``.
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
    alone: NDArray[np.bool_]


def check_many(cases: Iterable[Case]) -> list[Outcome[RodCheck] | InvalidInput]:
    """An outcome for every case, in their order; in the place of one that makes no sense, what is wrong with it."""
    cases = list(cases)
    found: list[Outcome[RodCheck] | InvalidInput | None] = [None] * len(cases)
    choices: dict[int, Choice[RodEffect]] = {}
    groups: dict[object, list[int]] = {}
    inputs, diagrams = np.empty((len(cases), len(COLUMNS))), {}
    began = time.perf_counter()
    for i, case in enumerate(cases):
        try:
            require_accuracy(case.accuracy)
            require_within_rod(case.scene, case.dimensions)
            choice = choose_for(case.scene, case.dimensions, case.effects, case.effect_tolerance, case.demands)
        except InvalidInput as refusal:
            found[i] = refusal
            continue
        composition = compose(choice)
        if composition.corrections:
            continue
        criterion = case.criterion or serensen(case.scene.material)
        diagrams[i], choices[i] = criterion.diagram(), choice
        inputs[i] = _row(case.scene, case.dimensions, composition, choice.has("friction"), case.accuracy)
        groups.setdefault((_shared(case.scene.load), diagrams[i].lines.shape), []).append(i)
    for members in groups.values():
        load = cases[members[0]].scene.load
        results = np.empty((len(members), len(RESULTS)))
        _check_rows(load, inputs[members], [diagrams[i] for i in members], results)
        share = (time.perf_counter() - began) / len(cases)
        for i, row in zip(members, results.tolist(), strict=True):
            if row[0] == WHOLE:
                found[i] = _outcome(cases[i], choices[i], row, share)
    return [_alone(case) if outcome is None else outcome for case, outcome in zip(cases, found, strict=True)]


def check_strips(
    scene: Scene,
    dimensions: Array,
    composition: Composition,
    contact: bool = False,
    accuracy: float = 1e-6,
    criterion: FatigueCriterion | None = None,
    threads: int = 1,
) -> RodTable:
    """Strips of the dimensions b, h, l [m], shape (n, 3), in one machine with physics that somebody has chosen.

    ``contact`` asks for contact pressure and friction power. Threads share the strips; none holds the interpreter's
    lock. Raises InvalidInput where a strip makes no sense, and ValueError for a composition with corrections.
    """
    require_accuracy(accuracy)
    if composition.corrections:
        raise ValueError("corrections of the shape have no form for many strips: use check")
    dimensions = np.ascontiguousarray(dimensions, dtype=float).reshape(-1, 3)
    for b, h, l in dimensions[~_sound(dimensions, scene)][:1]:
        require_within_rod(scene, Dimensions(b, h, l))
    diagram = (criterion or serensen(scene.material)).diagram()
    any_strip = Dimensions(1.0, 1.0, 1.0)
    inputs = np.tile(_row(scene, any_strip, composition, contact, accuracy), (len(dimensions), 1))
    inputs[:, 12:15] = dimensions
    results = np.empty((len(dimensions), len(RESULTS)))
    _check_rows(scene.load, inputs, [diagram] * len(dimensions), results, threads)
    return _table(scene, dimensions, results)


def _sound(dimensions: Array, scene: Scene) -> NDArray[np.bool_]:
    good = np.isfinite(dimensions).all(axis=1) & (dimensions > 0.0).all(axis=1)
    return good & (dimensions[:, 2] <= scene.mechanism.rod_length)


def _shared(load: Load) -> object:
    """What loads have in common that may go through the loop together: smooth ones all, others none."""
    return None if not load.curve().breaks.size and not load.sharp_angles().size else id(load)


def _row(scene: Scene, d: Dimensions, composition: Composition, contact: bool, accuracy: float) -> tuple[float, ...]:
    m, p, material, load = scene.mechanism, scene.piston, scene.material, scene.load
    curve, beam = load.curve(), composition.beam
    shear = SHEAR_FACTOR * material.shear_modulus
    return (
        curve.level, curve.sharpness, curve.phase, load.reference_pressure(), p.area,
        sum(part.mass(scene) for part in composition.moving), m.crank_radius, m.rod_length, m.angular_speed,
        material.elastic_modulus, material.density, shear, d.b, d.h, d.l, p.skirt_length, p.clamp_offset,
        p.friction_coefficient, beam.couples, float(beam.shears), float(composition.feedback), float(contact), accuracy,
    )  # fmt: skip


@cache
def _gauss(points: int) -> Array:
    return np.stack(legendre.leggauss(points))


def _check_rows(load: Load, inputs: Array, diagrams: Sequence[Diagram], results: Array, threads: int = 1) -> None:
    """Results of inputs that share a load's pieces: the loop, chunk by chunk, and what it leaves to be read along the
    strip."""
    ends = [*range(0, len(inputs), _CHUNK), len(inputs)]
    if threads == 1:
        for first, last in pairwise(ends):
            _check_chunk(load, inputs[first:last], diagrams[first:last], results[first:last])
        return
    with ThreadPoolExecutor(threads) as pool:
        list(
            pool.map(
                lambda at: _check_chunk(load, inputs[slice(*at)], diagrams[slice(*at)], results[slice(*at)]),
                pairwise(ends),
            )
        )


def _check_chunk(load: Load, inputs: Array, diagrams: Sequence[Diagram], results: Array) -> None:
    curve, count, rule = load.curve(), len(inputs), rule_of(_POINTS)
    lines = np.stack([diagram.lines for diagram in diagrams])
    parabolas = np.stack([diagram.parabola for diagram in diagrams])
    # A plain turn is read at once, but for diagrams that are not convex.
    plain = not inputs[:, _BENDING].any() and lines.shape[2] == 1 and not parabolas.any()
    room = 0 if plain else count
    counts, edges = _first_edges(load, inputs)
    states = np.empty((room, ROWS, MOST_PANELS * _POINTS))
    check_rows(
        inputs, lines, parabolas, curve.breaks, curve.pieces, rule, energies(), _gauss(22), _gauss(16), results, counts,
        edges, states,
    )  # fmt: skip
    for i in np.flatnonzero(results[:, 0] == TURN_ALONE).tolist():
        size = int(results[i, _AT["angles"]])
        table = np.ascontiguousarray(states[i, :, :size])
        _read_along(edges[i, : size // _POINTS + 1].copy(), rule, table, inputs[i], diagrams[i], results[i])


def _first_edges(load: Load, inputs: Array) -> tuple[NDArray[np.intp], Array]:
    """How many edges each row's panels begin with, and these; more than there is room for are not told."""
    curve, sharp = load.curve(), np.ascontiguousarray(load.sharp_angles(), dtype=float)
    counts, edges = np.empty(len(inputs), dtype=np.intp), np.empty((len(inputs), MOST_PANELS + 1))
    shared = None
    for i, row in enumerate(inputs):
        rubs = bool(row[_FEEDBACK]) and bool(row[_RUBS])
        if rubs or shared is None:
            found = panel_edges(*_machine_of(curve, row), sharp)
            shared = shared if rubs else found
        else:
            found = shared
        # One more than there is room for says that there are too many.
        counts[i] = min(found.size, MOST_PANELS + 1)
        edges[i, : counts[i]] = found[: counts[i]]
        counts[i] = counts[i] if found.size <= MOST_PANELS + 1 else 0
    return counts, edges


def _machine_of(curve: PressureCurve, row: Array) -> tuple[Drive, Strip]:
    """A row of inputs as kernels of the single check take it."""
    v = dict(zip(COLUMNS, row.tolist(), strict=True))
    drive = Drive(
        v["level"], v["sharpness"], v["phase"], curve.breaks, curve.pieces, v["back_pressure"], v["area"], v["mass"],
        v["crank_radius"], v["rod_length"], v["angular_speed"],
    )  # fmt: skip
    stiffness = v["elastic_modulus"] * v["b"] * v["h"] ** 3 / 12.0
    buckled = critical_force(v["elastic_modulus"], v["b"], v["h"], v["l"], v["rod_length"])
    strip = Strip(
        stiffness=stiffness,
        length=v["l"],
        rod_length=v["rod_length"],
        couples=v["couples"],
        compliance=stiffness / (v["shear_modulus"] * v["b"] * v["h"]) if v["shears"] else 0.0,
        friction=4.0 / math.pi * v["friction_coefficient"] if v["feedback"] else 0.0,
        lever=6.0 / v["skirt_length"],
        offset=v["clamp_offset"],
        buckled=-2.0 * float(buckled),
    )
    return drive, strip


def _read_along(edges: Array, rule: Rule, states: Array, row: Array, diagram: Diagram, result: Array) -> None:
    """Stresses and deflection along a strip of a sampled turn, into its row of results."""
    modulus, b, h, l, accuracy = row[9], row[12], row[13], row[14], row[-1]
    none, shears = np.empty((0, states.shape[1])), bool(row[19])
    field = Field(
        edges=edges,
        rule=rule,
        states=states,
        side=states[SIDE],
        bent=none,
        sunk=none,
        ripple=NO_RINGING.ripple,
        bent_parts=NO_RINGING.bent,
        sunk_parts=NO_RINGING.sunk,
        length=float(l),
        compliance=float(modulus * b * h**3 / 12.0 / (row[11] * b * h)) if shears else 0.0,
        direct=float(1.0 / (b * h)),
        bending=float(0.5 * modulus * h),
        inclined=False,
    )
    tolerance = _SHARE * float(accuracy)
    table = station_table(field, STATIONS, tolerance)
    fatigue = worst(field, table, FIBRES, diagram, tolerance, located=True)
    strength = worst(field, table, FIBRES, GREATEST, tolerance)
    bent = worst(field, table, DEFLECTION, GREATEST, tolerance)
    amplitude = 0.5 * (fatigue.high - fatigue.low)
    of_amplitude = fatigue.extremes_error / amplitude if amplitude else 0.0
    error = max(*(found.relative_error for found in (fatigue, strength, bent)), of_amplitude)
    told = (fatigue.value, strength.value, fatigue.high, fatigue.low, fatigue.section, fatigue.layer)
    result[_AT["utilisation"] : _AT["layer"] + 1] = told
    result[_AT["deflection"]] = bent.value
    result[_AT["error"]] = max(result[_AT["error"]], error)
    # A finer turn is the single check's.
    result[0] = WHOLE if error <= accuracy else LEFT


def _outcome(case: Case, choice: Choice[RodEffect], row: list[float], share: float) -> Outcome[RodCheck]:
    """A row of results as the single check tells it."""
    (
        _, critical, pushed, pulled, frequency, utilisation, strength, high, low, section, layer, side, moment,
        deflection, contact, power, error, angles,
    ) = row  # fmt: skip
    scene, d = case.scene, case.dimensions
    piston, material = scene.piston, scene.material
    touches = not math.isnan(contact)
    stresses = Stresses(
        fatigue_safety=1.0 / utilisation if utilisation > 0.0 else None,
        yield_safety=material.yield_strength / strength if strength > 0.0 else None,
        stress_amplitude=0.5 * (high - low),
        stress_mean=0.5 * (high + low),
        worst_section=section,
        worst_fibre=1 - 2 * int(layer),
        side_force_max=side,
        clamp_moment_max=moment,
        deflection_ratio=deflection / d.l,
        contact_pressure_max=contact * pressure_per_load(piston.diameter, piston.skirt_length) if touches else None,
        friction_power=power if touches else None,
    )
    safety = critical / pushed if pushed > 0.0 else None
    value = RodCheck(
        dimensions=d,
        stability_safety=safety,
        critical_force=critical,
        buckles_sideways=d.b < d.h,
        axial_force_min=-pushed,
        axial_force_max=pulled,
        mass=material.density * d.b * d.h * d.l,
        natural_frequency=frequency,
        criterion=(case.criterion or serensen(material)).name,
        stresses=stresses,
        warnings=warnings_of(scene, stresses, safety, False),
    )
    settings = {"angles": int(angles), "stations": STATIONS, "tolerance": _SHARE * case.accuracy}
    accuracy = Accuracy(case.accuracy, error, settings)
    return Outcome(Status.SUCCEEDED, value, choice.manifest, accuracy, timing={"solve_s": share})


def _alone(case: Case) -> Outcome[RodCheck] | InvalidInput:
    try:
        return case.alone()
    except InvalidInput as refusal:
        return refusal


def _table(scene: Scene, dimensions: Array, results: Array) -> RodTable:
    def column(name: str) -> Array:
        return results[:, _AT[name]].copy()

    pushed, high, low = column("pushed"), column("high"), column("low")
    with np.errstate(divide="ignore", invalid="ignore"):
        stability = np.where(pushed > 0.0, column("critical_force") / pushed, np.where(pushed <= 0.0, np.inf, np.nan))
    per_load = pressure_per_load(scene.piston.diameter, scene.piston.skirt_length)
    return RodTable(
        utilisation=column("utilisation"),
        stability=stability,
        greatest_stress=column("strength"),
        stress_amplitude=0.5 * (high - low),
        stress_mean=0.5 * (high + low),
        worst_section=column("section"),
        side_force_max=column("side"),
        clamp_moment_max=column("moment"),
        deflection=column("deflection"),
        contact_pressure_max=column("contact_load") * per_load,
        friction_power=column("power"),
        critical_force=column("critical_force"),
        natural_frequency=column("natural_frequency"),
        mass=scene.material.density * dimensions.prod(axis=1),
        estimated=column("error"),
        alone=results[:, 0] == LEFT,
    )
