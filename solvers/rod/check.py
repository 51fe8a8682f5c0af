"""Evaluating a given strip: stresses, fatigue, stability, and what the piston feels."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from solvers.effects import AUTO, Demand, EffectSelection
from solvers.errors import InvalidInput
from solvers.fatigue import FatigueCriterion, serensen
from solvers.numerics import periodic
from solvers.numerics.periodic import Estimate
from solvers.outcome import Accuracy, Outcome, Status
from solvers.rod import friction, shear, stability
from solvers.rod.cycle import Array, Cycle, Instants, bending_stiffness
from solvers.rod.effects import choose_for, compose
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.vibration import natural_frequency

LEAST_STATIONS = 25
_RESOLVED = 1e-2
_ROUNDING = 1e-14
SMALL_DISPLACEMENT_LIMIT = 0.15
"""V/l and r/L up to which the paper found the small-displacement theory good to 5 %."""


@dataclass(frozen=True)
class Stresses:
    """What the fibres see at the section and fibre that govern: lengths in m, stresses in Pa, ``fibre`` +1 or -1."""

    fatigue_safety: float | None
    yield_safety: float | None
    stress_amplitude: float
    stress_mean: float
    worst_section: float
    worst_fibre: int
    side_force_max: float
    clamp_moment_max: float
    deflection_ratio: float
    contact_pressure_max: float | None
    friction_power: float | None


@dataclass(frozen=True)
class RodCheck:
    """The results of a check, SI units.

    A safety without a load to fail under is None: stability of a rod never compressed, fatigue of one never
    stressed. ``stresses`` is None beyond the stability boundary, where the formulas no longer mean anything.
    """

    dimensions: Dimensions
    stability_safety: float | None
    critical_force: float
    buckles_sideways: bool
    axial_force_min: float
    axial_force_max: float
    mass: float
    natural_frequency: float
    criterion: str
    stresses: Stresses | None
    warnings: tuple[str, ...]


def check(
    scene: Scene,
    dimensions: Dimensions,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    criterion: FatigueCriterion | None = None,
    demands: tuple[Demand, ...] = (),
) -> Outcome[RodCheck]:
    """Evaluate a strip in its machine.

    ``accuracy`` is the relative numerical accuracy wanted of every result, 1e-12 … 1e-1; ``criterion`` the fatigue
    convention, Serensen's unless another is given; ``demands`` are effects that somebody's limits call for.
    Raises InvalidInput where the request makes no sense, EffectConflict for an excluded effect in demand.
    """
    started = time.perf_counter()
    if not 1e-12 <= accuracy <= 1e-1:
        raise InvalidInput("accuracy", "lies outside what can be asked for", "[1e-12, 1e-1]")
    if dimensions.l > scene.mechanism.rod_length:
        raise InvalidInput("dimensions.l", "the free length exceeds the rod", "at most mechanism.rod_length")
    choice = choose_for(scene, dimensions, effects, effect_tolerance, demands)
    cycle = Cycle(scene, dimensions, compose(choice))
    criterion = criterion or serensen(scene.material)

    force = _force_extremes(cycle, 0.1 * accuracy)
    critical = _critical_force(scene, dimensions, choice.has("shear"))
    compression = max(-force.least.value, 0.0)
    safety = critical / compression if compression > 0 else None
    stresses, error = None, force.relative_error
    if safety is None or safety > 1:
        stresses, error = _stresses(cycle, criterion, choice.has("friction"), accuracy, force)
    mean_force = 0.5 * (force.least.value + force.greatest.value)
    value = RodCheck(
        dimensions=dimensions,
        stability_safety=safety,
        critical_force=critical,
        buckles_sideways=dimensions.b < dimensions.h,
        axial_force_min=force.least.value,
        axial_force_max=force.greatest.value,
        mass=scene.material.density * dimensions.b * dimensions.h * dimensions.l,
        natural_frequency=natural_frequency(scene, dimensions, mean_force),
        criterion=criterion.name,
        stresses=stresses,
        warnings=_warnings(scene, stresses, choice.has("large_displacement")),
    )
    settings = {"angles": force.samples, "stations": LEAST_STATIONS, "tolerance": 0.1 * accuracy}
    return Outcome(
        status=Status.SUCCEEDED,
        value=value,
        effects=choice.manifest,
        accuracy=Accuracy(accuracy, max(error, _ROUNDING), settings),
        timing={"solve_s": time.perf_counter() - started},
    )


@dataclass(frozen=True)
class _ForceExtremes:
    least: Estimate
    greatest: Estimate
    samples: int

    @property
    def relative_error(self) -> float:
        parts = [e.error / abs(e.value) for e in (self.least, self.greatest) if e.value]
        return max(parts, default=0.0)


def _force_extremes(cycle: Cycle, tolerance: float) -> _ForceExtremes:
    angles = periodic.resolve(lambda angle: cycle.axial_force(angle)[None], _RESOLVED)
    values = cycle.axial_force(angles)
    least = periodic.maximum(lambda angle: -cycle.axial_force(angle), tolerance, angles, -values)
    greatest = periodic.maximum(cycle.axial_force, tolerance, angles, values)
    return _ForceExtremes(Estimate(-least.value, least.error, least.angle, least.samples), greatest, angles.size)


def _critical_force(scene: Scene, dimensions: Dimensions, with_shear: bool) -> float:
    """P_cr [N] about the weaker axis, with shear where that effect runs (bending in the crank's plane)."""
    material, length = scene.material, scene.mechanism.rod_length
    plain = float(stability.critical_force(material.elastic_modulus, dimensions.b, dimensions.h, dimensions.l, length))
    if not with_shear:
        return plain
    stiffness = bending_stiffness(scene, dimensions)
    compliance = stiffness / shear.shear_stiffness(scene, dimensions)
    return min(plain, -stiffness * shear.critical_coupling(dimensions.l, length, compliance))


def _fibre_stresses(cycle: Cycle, instants: Instants, stations: Array) -> Array:
    """sigma = N/(b h) +- (E h/2) V'' [Pa], shape (2, stations, angles): first the fibre at +h/2."""
    d, modulus = cycle.dimensions, cycle.scene.material.elastic_modulus
    direct = instants.shape.axial_force(stations) / (d.b * d.h)
    bending = 0.5 * modulus * d.h * instants.shape.curvature(stations)
    return np.stack([direct + bending, direct - bending])


def _stresses(
    cycle: Cycle, criterion: FatigueCriterion, contact: bool, accuracy: float, force: _ForceExtremes
) -> tuple[Stresses, float]:
    tolerance = 0.1 * accuracy
    angles = periodic.resolve(lambda angle: _signature(cycle, angle), _RESOLVED)
    instants = cycle.at(angles)
    stations = np.linspace(0.0, cycle.dimensions.l, LEAST_STATIONS)
    search = _SectionSearch(cycle, instants, stations, _fibre_stresses(cycle, instants, stations), tolerance)
    fatigue = search.worst(lambda high, low: criterion.utilisation(0.5 * (high - low), 0.5 * (high + low)))
    strength = search.worst(lambda high, low: np.maximum(high, -low))

    def greatest(function: periodic.Periodic, samples: Array) -> Estimate:
        return periodic.maximum(function, tolerance, angles, samples)

    side = greatest(lambda a: np.abs(cycle.at(a).shape.side_force()), np.abs(instants.shape.side_force()))
    moment = greatest(lambda a: np.abs(cycle.at(a).shape.clamp_moment()), np.abs(instants.shape.clamp_moment()))
    errors = [force.relative_error, fatigue.error, strength.error, _relative(side), _relative(moment)]
    pressure = power = None
    if contact:
        highest = greatest(lambda a: friction.pressure(cycle, a), friction.pressure(cycle, angles))
        average = periodic.mean(lambda a: friction.power(cycle, a), tolerance)
        pressure, power = highest.value, average.value
        errors += [_relative(highest), _relative(average)]
    bent = np.max(np.abs(instants.shape.deflection(stations)), initial=0.0)
    return (
        Stresses(
            fatigue_safety=1.0 / fatigue.value if fatigue.value > 0 else None,
            yield_safety=cycle.scene.material.yield_strength / strength.value if strength.value > 0 else None,
            stress_amplitude=0.5 * (fatigue.high - fatigue.low),
            stress_mean=0.5 * (fatigue.high + fatigue.low),
            worst_section=fatigue.station,
            worst_fibre=fatigue.fibre,
            side_force_max=side.value,
            clamp_moment_max=moment.value,
            deflection_ratio=float(bent) / cycle.dimensions.l,
            contact_pressure_max=pressure,
            friction_power=power,
        ),
        max(errors),
    )


def _signature(cycle: Cycle, angle: Array) -> Array:
    """Quantities whose humps are those of every result: force, clamp moment, side force."""
    instants = cycle.at(angle)
    return np.stack([instants.force, instants.shape.clamp_moment(), instants.shape.side_force()])


def _relative(estimate: Estimate) -> float:
    return estimate.error / abs(estimate.value) if estimate.value else 0.0


@dataclass(frozen=True)
class _Section:
    value: float
    error: float
    station: float
    fibre: int
    high: float
    low: float


@dataclass(frozen=True)
class _SectionSearch:
    """Finds the fibre and section where a function of a stress cycle's extremes is greatest."""

    cycle: Cycle
    instants: Instants
    stations: Array
    samples: Array
    tolerance: float

    def worst(self, severity) -> _Section:
        """The worst over both fibres and all sections of ``severity(highest, lowest stress)``."""
        table = severity(self.samples.max(axis=2), self.samples.min(axis=2))
        fibre, station = np.unravel_index(int(np.argmax(table)), table.shape)
        start = self._section(severity, int(fibre), float(self.stations[station]))
        row = table[fibre]
        if not _peaks_inside(row, int(station)):
            return start
        from scipy.optimize import minimize_scalar

        low = self.stations[max(station - 1, 0)]
        high = self.stations[min(station + 1, self.stations.size - 1)]
        span = float(high - low)
        found = minimize_scalar(
            lambda z: -self._section(severity, int(fibre), float(z)).value,
            bounds=(low, high),
            method="bounded",
            options={"xatol": span * max(math.sqrt(self.tolerance), 1e-8), "maxiter": 60},
        )
        inside = self._section(severity, int(fibre), float(found.x))
        best = inside if inside.value > start.value else start
        # At a smooth peak the value is wrong by the square of the place's relative error.
        return _Section(best.value, best.error + self.tolerance, best.station, best.fibre, best.high, best.low)

    def _section(self, severity, fibre: int, station: float) -> _Section:
        def stress(angle: Array) -> Array:
            return _fibre_stresses(self.cycle, self.cycle.at(angle), np.array([station]))[fibre, 0]

        angles = self.instants.angle
        samples = _fibre_stresses(self.cycle, self.instants, np.array([station]))[fibre, 0]
        high = periodic.maximum(stress, self.tolerance, angles, samples)
        low = periodic.maximum(lambda angle: -stress(angle), self.tolerance, angles, -samples)
        value = float(severity(high.value, -low.value))
        scale = float(severity(abs(high.value), -abs(low.value)))
        share = (high.error + low.error) / max(abs(high.value), abs(low.value), np.finfo(float).tiny)
        error = share * scale / value if value > 0 else 0.0
        return _Section(value, error, station, 1 - 2 * fibre, high.value, -low.value)


def _peaks_inside(row: Array, station: int) -> bool:
    """Whether the samples leave room for a peak between stations: not when they fall away from an end."""
    if 0 < station < row.size - 1:
        return True
    a, b, c = row[:3] if station == 0 else row[:-4:-1]
    return bool((b - a) >= 0.5 * (c - b) and a - 2 * b + c < 0) or bool(a <= b)


def _warnings(scene: Scene, stresses: Stresses | None, large: bool) -> tuple[str, ...]:
    out = []
    if stresses is None:
        out.append("the strip buckles under the greatest compression of the cycle; stresses have no meaning there")
    if scene.mechanism.crank_radius / scene.mechanism.rod_length > SMALL_DISPLACEMENT_LIMIT:
        out.append("r/L exceeds 0.15: beyond what experiments confirm for the small-displacement theory")
    if stresses is not None and stresses.deflection_ratio > SMALL_DISPLACEMENT_LIMIT and not large:
        out.append("V/l exceeds 0.15: the small-displacement theory may be wrong by more than 5 %")
    return tuple(out)
