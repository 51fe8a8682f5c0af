"""The kind crank-masses: masses by pendulum, weighing or estimate, in millimetres and kilograms."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, RootModel

from app.designs.crank_masses.chain import calculation
from app.designs.crank_masses.drawing import drawing
from app.designs.crank_masses.form import FORM
from app.designs.kind import Answer, Job, Kind, Mode
from app.designs.schema import Entry, NotNegative, Positive, SolverRequest, Strict, accuracy_json, one_named, refused
from app.designs.units import MILLI, in_si, si
from solvers import crank
from solvers.errors import InvalidInput
from solvers.outcome import Accuracy

Amplitude = Annotated[float, Field(ge=0, lt=90, description="amplitude of the swing to either side")]
Gravity = Annotated[float, Field(gt=0, le=100)]
# Six of them beyond a right angle are a half turn, at which a pendulum's period is not finite.
AmplitudeUncertainty = Annotated[float, Field(ge=0, le=15)]

_NOT_MEASURED = {*SolverRequest.model_fields, "method", "uncertainty"}


def _measured(request: SolverRequest) -> dict[str, Any]:
    """What was measured, under the solver's names and in SI units."""
    return {name: value for name, value in si(request).items() if name not in _NOT_MEASURED}


class PendulumUncertainty(Strict):
    """Standard uncertainties of what was measured."""

    pivot_distance_mm: NotNegative = 0.0
    period_small_end_s: NotNegative = 0.0
    period_big_end_s: NotNegative = 0.0
    rod_mass_kg: NotNegative = 0.0
    amplitude_deg: AmplitudeUncertainty = 0.0
    gravity_m_s2: NotNegative = 0.0
    small_end_bore_radius_mm: NotNegative = 0.0
    big_end_bore_radius_mm: NotNegative = 0.0


class PendulumRequest(SolverRequest):
    """The rod swings from its small end, then from its big end."""

    method: Literal["pendulum"]
    pivot_distance_mm: Positive = Field(description="distance between the two knife edges")
    period_small_end_s: Positive = Field(description="period when hung at the small end")
    period_big_end_s: Positive = Field(description="period when hung at the big end")
    rod_mass_kg: Positive
    amplitude_deg: Amplitude = 0.0
    gravity_m_s2: Gravity = 9.80665
    small_end_bore_radius_mm: NotNegative = Field(
        default=0.0, description="bore radius where the knife edge supports the inside of the bore"
    )
    big_end_bore_radius_mm: NotNegative = 0.0
    uncertainty: PendulumUncertainty = PendulumUncertainty()

    def solve(self) -> crank.RodMasses:
        return crank.swing(crank.Pendulum(**_measured(self), uncertainty=si(self.uncertainty)))


class WeighingUncertainty(Strict):
    """Standard uncertainties of what was measured."""

    length_mm: NotNegative = 0.0
    small_end_reading_kg: NotNegative = 0.0
    big_end_reading_kg: NotNegative = 0.0
    period_small_end_s: NotNegative = 0.0
    amplitude_deg: AmplitudeUncertainty = 0.0
    gravity_m_s2: NotNegative = 0.0
    small_end_bore_radius_mm: NotNegative = 0.0


class WeighingRequest(SolverRequest):
    """The rod lies level on two supports at its pin centres; a period adds the moment of inertia."""

    method: Literal["weighing"]
    length_mm: Positive = Field(description="distance between the pin centres")
    small_end_reading_kg: Positive
    big_end_reading_kg: Positive
    rod_mass_kg: Positive | None = Field(
        default=None, description="total mass, weighed separately to check the sum of the two readings"
    )
    period_small_end_s: Positive | None = Field(
        default=None, description="period when hung at the small end; null: no moment of inertia is computed"
    )
    small_end_bore_radius_mm: NotNegative = 0.0
    amplitude_deg: Amplitude = 0.0
    gravity_m_s2: Gravity = 9.80665
    uncertainty: WeighingUncertainty = WeighingUncertainty()

    def solve(self) -> crank.RodMasses:
        uncertainty = si(self.uncertainty)
        if self.period_small_end_s is None:
            uncertainty.pop("period_small_end")
        return crank.weigh(crank.Weighing(**_measured(self), uncertainty=uncertainty))


class EstimateUncertainty(Strict):
    """Standard uncertainties of what was assumed."""

    bore_mm: NotNegative = 0.0
    piston_kg_m2: NotNegative = 0.0
    rod_kg_m2: NotNegative = 0.0


class EstimateRequest(SolverRequest):
    """Constructive masses of an existing engine, scaled to a bore."""

    method: Literal["estimate"]
    bore_mm: Positive
    piston_kg_m2: Positive = Field(description="mass of the piston group per piston area")
    rod_kg_m2: Positive = Field(description="mass of the rod per piston area")
    uncertainty: EstimateUncertainty = EstimateUncertainty()

    def solve(self) -> crank.RodMasses:
        u = self.uncertainty
        uncertainty = {
            "bore": u.bore_mm * MILLI, "piston_area_density": u.piston_kg_m2, "rod_area_density": u.rod_kg_m2,
        }  # fmt: skip
        return crank.estimate(
            crank.Estimate(self.bore_mm * MILLI, self.piston_kg_m2, self.rod_kg_m2, uncertainty=uncertainty)
        )


_METHODS = {"pendulum": PendulumRequest, "weighing": WeighingRequest, "estimate": EstimateRequest}
_Method = one_named("method", _METHODS)


class MassesRequest(RootModel[_Method]):  # type: ignore[valid-type]
    """Masses of a rod by one of three methods."""

    model_config = ConfigDict(strict=True, frozen=True, hide_input_in_errors=True)

    @property
    def name(self) -> str:
        return self.root.name

    def contradictions(self) -> list[Entry]:
        return self.root.contradictions()


class MassesResult(Strict):
    """Results, null if the method does not provide them; ``_u``: standard uncertainties, null if unknown."""

    rod_cg_from_pin_mm: float | None
    rod_cg_from_pin_mm_u: float | None
    rod_mass_at_pin_kg: float | None
    rod_mass_at_pin_kg_u: float | None
    rod_mass_at_crank_kg: float | None
    rod_mass_at_crank_kg_u: float | None
    rod_inertia_kg_m2: float | None
    rod_inertia_kg_m2_u: float | None
    inertia_defect_kg_m2: float | None
    inertia_defect_kg_m2_u: float | None
    piston_mass_kg: float | None
    piston_mass_kg_u: float | None
    rod_mass_kg: float | None
    rod_mass_kg_u: float | None
    uncertainty_method: str | None = Field(
        description="linear propagation of uncertainty, or Monte Carlo where that is not valid"
    )
    intervals: dict[str, list[float]] = Field(
        description="central 95 % intervals by Monte Carlo, of the quantities that needed it"
    )
    warnings: list[str]


_SHOWN = (
    "rod_cg_from_pin_mm", "rod_mass_at_pin_kg", "rod_mass_at_crank_kg", "rod_inertia_kg_m2", "inertia_defect_kg_m2",
    "piston_mass_kg", "rod_mass_kg",
)  # fmt: skip


def run_masses(request: MassesRequest) -> Answer:
    """Determine the masses by the requested method."""
    asked, started = request.root, time.perf_counter()
    try:
        found = asked.solve()
    except InvalidInput as refusal:
        return refused(asked, refusal)
    result: dict[str, Any] = {}
    intervals: dict[str, list[float]] = {}
    known = found.uncertainty
    for shown in _SHOWN:
        name, unit = in_si(shown)
        value = found.values.get(name)
        result[shown] = None if value is None else value / unit
        result[shown + "_u"] = None if known is None or name not in known.standard else known.standard[name] / unit
        if known is not None and name in known.interval:
            intervals[shown] = [end / unit for end in known.interval[name]]
    result |= {"uncertainty_method": known and known.method, "intervals": intervals, "warnings": list(found.warnings)}
    accuracy = accuracy_json(Accuracy(asked.accuracy, found.rounding, {"form": "closed"}))
    return Answer("succeeded", result, [], accuracy, {"solve_s": time.perf_counter() - started})


def figure(_mode: Mode, result: Mapping[str, Any]) -> tuple[str, float | None]:
    """The rod's mass at the wrist pin; for an estimate, which does not divide the rod, its whole mass."""
    name = "rod_mass_kg" if result["rod_mass_at_pin_kg"] is None else "rod_mass_at_pin_kg"
    return name, result[name]


CRANK_MASSES = Kind(
    slug="crank-masses",
    title="Crank masses",
    summary="a rod's reduced masses by swinging it, by weighing its ends, or by estimate",
    jobs={Mode.ANALYSIS: Job(MassesRequest, MassesResult, run_masses)},
    known_effects=(),
    plots={},
    main_results=(),
    figure=figure,
    form=FORM,
    drawing=drawing,
    calculation=calculation,
)
