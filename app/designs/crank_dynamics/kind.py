"""The kind crank-dynamics: result models in degrees, megapascals and newtons, and calls into the solver."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from pydantic import Field

from app.designs.crank_dynamics.chain import FOLLOWED, calculation
from app.designs.crank_dynamics.drawing import drawing
from app.designs.crank_dynamics.form import FORM
from app.designs.crank_dynamics.pictures import PLOTS
from app.designs.crank_dynamics.reference import MAIN_RESULTS, dynamics_reference
from app.designs.crank_dynamics.request import DynamicsRequest
from app.designs.kind import Answer, Detail, Job, Kind, Mode
from app.designs.schema import RepairDone, Strict, bulk_answers, envelope, refusing, repairs_json, scaled
from app.designs.units import MEGA, MILLI
from solvers import crank
from solvers.crank.cycle.forces import Forces
from solvers.crank.engine.speed_fluctuation import SpeedFluctuation
from solvers.crank.engine.unbalance import Balance
from solvers.crank.motion.slider_crank import brix_error, two_harmonic_error
from solvers.outcome import Outcome


class Series(Strict):
    """Results over the angle, one list per quantity, each rounded to a hundredth of the accuracy asked, relative to
    its greatest value. Rod compression is positive; the radial force points to the shaft."""

    angle_deg: list[float]
    pressure_mpa: list[float]
    brix_pressure_mpa: list[float] | None = Field(
        description="the diagram's pressures unrolled by Brix's construction; null: pressures given over the angle"
    )
    gas_force_n: list[float]
    inertia_force_n: list[float]
    side_force_n: list[float]
    rod_force_n: list[float]
    tangential_force_n: list[float]
    radial_force_n: list[float]
    torque_nm: list[float]
    wrist_pin_load_n: list[float]
    crank_pin_load_n: list[float]
    main_bearing_load_n: list[float]


class WorstInstant(Strict):
    """The instant of a force's maximum."""

    name: str
    angle_deg: float
    force_n: float
    pressure_mpa: float
    feeds: str | None = Field(description="the kind of design for which this instant is the load")


class CyclePoints(Strict):
    """The pressures used, for rod designs that reference this run as their load."""

    angle_deg: list[float]
    pressure_mpa: list[float]


class Jump(Strict):
    angle_deg: float
    jump_mpa: float = Field(description="pressure just after the dead centre minus that just before it")


class Unbalance(Strict):
    order: int
    force_n: float
    couple_nm: float | None


class EngineResult(Strict):
    """Results of the whole engine."""

    mean_torque_nm: float
    torque_max_nm: float
    torque_min_nm: float
    indicated_power_w: float
    reciprocating_unbalance: list[Unbalance]
    rotating_unbalance_n: float
    rotating_couple_nm: float | None
    shared_crank_pin_load_max_n: float | None
    shared_main_bearing_load_max_n: float | None


class DynamicsResult(Strict):
    """Forces over the cycle; top-level torque and power are of one cylinder, the irregularity is the shaft's."""

    reciprocating_mass_kg: float
    rotating_mass_kg: float
    rod_mass_at_pin_kg: float
    rod_mass_at_crank_kg: float
    inertia_defect_kg_m2: float
    mean_torque_nm: float
    indicated_power_w: float
    irregularity: float | None = Field(
        description="(maximum - minimum speed)/mean speed with the given inertia; null: no inertia given"
    )
    torque_irregularity: float | None = Field(
        description="(maximum - minimum torque)/mean torque; null: the mean torque is zero"
    )
    work_fluctuation_j: float = Field(description="work between the minimum and the maximum of the speed")
    shaft_inertia_kg_m2: float
    flywheel_inertia_wanted_kg_m2: float | None = Field(
        description="null: no coefficient of speed fluctuation was requested"
    )
    brix_error: float = Field(description="maximum error of Brix's displacement, relative to the crank radius")
    two_harmonic_error: float = Field(
        description="maximum error of the two-harmonic acceleration, relative to the maximum acceleration"
    )
    brix_pressure_error_mpa: float | None
    gas_force_max_n: float
    rod_compression_max_n: float
    rod_tension_max_n: float = Field(description="negative where the rod is never in tension")
    side_force_max_n: float
    wrist_pin_load_max_n: float
    crank_pin_load_max_n: float
    main_bearing_load_max_n: float
    stroke_mm: float
    upper_dead_centre_deg: float
    lower_dead_centre_deg: float
    worst: list[WorstInstant]
    engine: EngineResult | None
    dead_centre_jumps: list[Jump]
    repairs: list[RepairDone]
    cycle: CyclePoints | None = Field(
        description="pressures of a two-stroke cycle; null: a four-stroke cycle, which cannot load a rod"
    )
    series: Series
    warnings: list[str]


_FEEDS = {"wrist_pin_load_max": "pin-profile", "rod_compression_max": "flexible-rod", "rod_tension_max": "flexible-rod"}


_ROUNDED = 1e-2
"""Step of the series' numbers in units of the accuracy asked and of each column's greatest value."""


def _rounded(columns: Sequence[np.ndarray], accuracy: float) -> list[list[float]]:
    """Each column rounded to decimal places, at least to units: the numbers of a series would otherwise be two thirds
    longer, by digits beyond their accuracy."""
    values = np.array(columns)
    step = _ROUNDED * accuracy * np.abs(values).max(axis=1, keepdims=True)
    scale = 10.0 ** np.ceil(-np.log10(np.clip(step, 1e-15, 1.0)))
    return (np.rint(values * scale) / scale + 0.0).tolist()  # + 0: no negative zeros


def _series(found: crank.CrankDynamics, accuracy: float) -> dict[str, Any]:
    f: Forces = found.series
    columns = {
        "angle_deg": np.degrees(found.angle),
        "pressure_mpa": f.pressure / MEGA,
        "brix_pressure_mpa": None if found.brix_pressure is None else found.brix_pressure / MEGA,
        "gas_force_n": f.gas,
        "inertia_force_n": f.inertia,
        "side_force_n": f.side,
        "rod_force_n": f.rod,
        "tangential_force_n": f.tangential,
        "radial_force_n": f.radial,
        "torque_nm": f.torque,
        "wrist_pin_load_n": f.wrist_pin_load,
        "crank_pin_load_n": f.crank_pin_load,
        "main_bearing_load_n": f.main_bearing_load,
    }
    given = {name: column for name, column in columns.items() if column is not None}
    return {**columns, **dict(zip(given, _rounded(list(given.values()), accuracy), strict=True))}


def _cycle(found: crank.CrankDynamics, scene: crank.Scene) -> dict[str, Any] | None:
    if scene.cylinder.strokes != 2:
        return None
    curve = found.cycle.curve
    if isinstance(scene.pressure, crank.TablePressure):
        angle, pressure = scene.pressure.open_cycle(scene.cylinder.period)
    else:
        angle = np.unique(np.concatenate([np.mod(curve.breaks, scene.cylinder.period), found.angle]))
        pressure = curve.pressure(angle)
    return {"angle_deg": np.degrees(angle).tolist(), "pressure_mpa": (pressure / MEGA).tolist()}


def _engine(found: crank.CrankDynamics, cylinders: int) -> dict[str, Any] | None:
    fluctuation: SpeedFluctuation = found.speed_fluctuation
    unbalance: Balance | None = found.balance
    if unbalance is None:
        return None
    pin = found.shared_pin
    return {
        "mean_torque_nm": fluctuation.torque_mean,
        "torque_max_nm": fluctuation.torque_max,
        "torque_min_nm": fluctuation.torque_min,
        "indicated_power_w": cylinders * found.indicated_power,
        "reciprocating_unbalance": [
            {"order": u.order, "force_n": u.force, "couple_nm": u.couple} for u in unbalance.reciprocating
        ],
        "rotating_unbalance_n": unbalance.rotating_force,
        "rotating_couple_nm": unbalance.rotating_couple,
        "shared_crank_pin_load_max_n": pin and pin[0],
        "shared_main_bearing_load_max_n": pin and pin[1],
    }


def case_of(request: DynamicsRequest) -> crank.Case:
    """The solver's case. Raises InvalidInput for input only the solver can reject."""
    selection, tolerance = request.selection(), request.effect_tolerance
    return crank.Case(request.scene()[0], selection, tolerance, request.accuracy, request.series_angles)


@refusing
def run_dynamics(request: DynamicsRequest) -> Answer:
    """Analyse a mechanism."""
    case = case_of(request)
    return _answer(request, case, case.evaluate())


def run_many(requests: Sequence[DynamicsRequest], detail: Detail) -> Iterator[Answer]:
    """Analyse mechanisms in bulk; results over the angle are computed only for full detail."""
    return bulk_answers(requests, case_of, crank.analyse_many, partial(_answer, detail=detail))


def _answer(
    request: DynamicsRequest, case: crank.Case, outcome: Outcome[crank.CrankDynamics], detail: Detail = Detail.FULL
) -> Answer:
    found, scene = outcome.value, case.scene
    result = _scalars(found, scene)
    # The repairs are recomputed for the answer; on valid data this does nothing.
    result["repairs"] = repairs_json(request, request.scene()[1]) if request.pressure.repair else []
    if detail is Detail.FULL:
        result |= {"cycle": _cycle(found, scene), "series": _series(found, request.accuracy)}
    return envelope(request, outcome, result)


def _scalars(found: crank.CrankDynamics, scene: crank.Scene) -> dict[str, Any]:
    masses, (top, bottom) = scene.masses, found.cycle.motion.dead_centres
    ratio = scene.mechanism.crank_radius / scene.mechanism.rod_length
    return {
        "reciprocating_mass_kg": masses.reciprocating,
        "rotating_mass_kg": masses.rotating(scene.mechanism.crank_radius),
        "rod_mass_at_pin_kg": masses.rod.at_wrist_pin,
        "rod_mass_at_crank_kg": masses.rod.at_crank_pin,
        "inertia_defect_kg_m2": masses.rod.inertia_defect,
        "mean_torque_nm": found.torque_mean,
        "indicated_power_w": found.indicated_power,
        "irregularity": found.speed_fluctuation.irregularity,
        "torque_irregularity": found.speed_fluctuation.torque_irregularity,
        "work_fluctuation_j": found.speed_fluctuation.work_fluctuation,
        "shaft_inertia_kg_m2": found.speed_fluctuation.inertia,
        "flywheel_inertia_wanted_kg_m2": found.speed_fluctuation.flywheel_inertia_wanted,
        "brix_error": brix_error(ratio),
        "two_harmonic_error": two_harmonic_error(ratio),
        "brix_pressure_error_mpa": scaled(found.brix_pressure_error, MEGA),
        **{f"{w.name}_n": w.force for w in found.worst},
        "stroke_mm": found.cycle.motion.stroke / MILLI,
        "upper_dead_centre_deg": math.degrees(top),
        "lower_dead_centre_deg": math.degrees(bottom),
        "worst": [
            {
                "name": w.name,
                "angle_deg": math.degrees(w.angle),
                "force_n": w.force,
                "pressure_mpa": w.pressure / MEGA,
                "feeds": _FEEDS.get(w.name),
            }
            for w in found.worst
        ],
        "engine": _engine(found, len(scene.engine.phases)),
        "dead_centre_jumps": [
            {"angle_deg": math.degrees(a), "jump_mpa": jump / MEGA} for a, jump in found.cycle.curve.jumps
        ],
        "warnings": list(found.warnings),
    }


def _figure(_mode: Mode, result: Mapping[str, Any]) -> tuple[str, float]:
    """The power of the whole engine, under its path in the result."""
    engine = result["engine"]
    if engine is None:
        return "indicated_power_w", result["indicated_power_w"]
    return "engine.indicated_power_w", engine["indicated_power_w"]


CRANK_DYNAMICS = Kind(
    slug="crank-dynamics",
    title="Crank dynamics",
    summary="forces, torque and power of a crank mechanism over its cycle, and the instants that load its parts",
    jobs={
        Mode.ANALYSIS: Job(
            DynamicsRequest,
            DynamicsResult,
            run_dynamics,
            reference=dynamics_reference,
            run_many=run_many,
            tables=("cycle", "series"),
        )
    },
    known_effects=crank.EFFECTS,
    plots=PLOTS,
    figure=_figure,
    main_results=MAIN_RESULTS,
    whole="engine",
    form=FORM,
    drawing=drawing,
    calculation=calculation,
    followed=frozenset(FOLLOWED),
)
