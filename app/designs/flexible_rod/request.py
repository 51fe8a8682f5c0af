"""Requests of the flexible rod in the units of the API, and their conversion to SI scenes."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field

from app.designs.crank_dynamics.request import CUBIC_CENTI, Diagram, Volume, stuck
from app.designs.references import Instant, Run, RunReference, cycle_of, source_of, worst_of
from app.designs.schema import (
    DesignSettings,
    Entry,
    Finite,
    NotNegative,
    Positive,
    SolverRequest,
    Strict,
    entry,
    listed_or_own,
    one_named,
)
from app.designs.units import MEGA, MILLI, si
from solvers import rod
from solvers.crank.gas.data_faults import Repair
from solvers.crank.gas.indicator_diagram import IndicatorPressure
from solvers.errors import InvalidInput
from solvers.fatigue import CRITERIA
from solvers.materials import LOSS_FACTOR
from solvers.rod.load.indicator import fields_of_load

MAX_POINTS = 10_000
MAX_THICKNESSES = 200


def _pascal(megapascal: float | None) -> float | None:
    return None if megapascal is None else megapascal * MEGA


class Mechanism(Strict):
    crank_radius_mm: Positive = Field(description="r, crank radius; less than the rod's length")
    rod_length_mm: Positive = Field(description="L, distance from the clamp in the piston to the crank pin")
    speed_hz: Positive = Field(description="revolutions per second")


class Piston(Strict):
    diameter_mm: Positive
    skirt_length_mm: Positive
    reciprocating_mass_kg: NotNegative = Field(
        default=0.0, description="mass of the piston and of the rod's upper share"
    )
    clamp_offset_mm: Finite = Field(default=0.0, description="e, distance of the clamp from mid-skirt toward the crank")
    friction_coefficient: float = Field(default=0.0, ge=0, le=1)


class _Load(Strict):
    """Base of all loads; by default, nothing is repaired."""

    def repairs(self, mechanism: rod.Mechanism, piston: rod.Piston) -> tuple[Repair, ...]:
        """Repairs of the user's points."""
        return ()


class SchmidtLoad(_Load):
    """p = p_min (1 + δ)/(1 − δ cos(φ − θ)): the isothermal Stirling cycle."""

    kind: Literal["schmidt"]
    p_min_mpa: NotNegative
    delta: float = Field(ge=0, lt=1, description="compression parameter")
    theta_rad: Finite = Field(description="crank angle of maximum pressure")
    back_pressure_mpa: Finite | None = Field(default=None, description="null: the mean of the cycle")

    def to_solver(self, mechanism: rod.Mechanism, piston: rod.Piston) -> rod.SchmidtLoad:
        return rod.SchmidtLoad(self.p_min_mpa * MEGA, self.delta, self.theta_rad, _pascal(self.back_pressure_mpa))


class TableLoad(_Load):
    """Pressures at crank angles, joined by a monotone periodic cubic.

    A last point may close the turn with the pressure of the first.
    """

    kind: Literal["table"]
    angle_deg: list[Finite] = Field(min_length=3, max_length=MAX_POINTS, description="ascending, within one revolution")
    pressure_mpa: list[Finite] = Field(min_length=3, max_length=MAX_POINTS, description="one per angle")
    back_pressure_mpa: Finite | None = Field(default=None, description="null: the mean of the cycle")

    def to_solver(self, mechanism: rod.Mechanism, piston: rod.Piston) -> rod.TableLoad:
        points = slice(-1 if self._closes else None)
        return rod.TableLoad(
            tuple(math.radians(a) for a in self.angle_deg[points]),
            tuple(p * MEGA for p in self.pressure_mpa[points]),
            _pascal(self.back_pressure_mpa),
        )

    @property
    def _closes(self) -> bool:
        """Whether the last point repeats the first one a turn later."""
        angle, pressure = self.angle_deg, self.pressure_mpa
        turn = math.isclose(angle[-1] - angle[0], 360.0, rel_tol=1e-9)
        return len(angle) == len(pressure) and turn and pressure[-1] == pressure[0]


class ConstantLoad(_Load):
    """One pressure at all angles, as a press or a test bench applies it."""

    kind: Literal["constant"]
    constant_pressure_mpa: Finite
    back_pressure_mpa: Finite | None = Field(default=None, description="null: none")

    def to_solver(self, mechanism: rod.Mechanism, piston: rod.Piston) -> rod.ConstantLoad:
        return rod.ConstantLoad(self.constant_pressure_mpa * MEGA, _pascal(self.back_pressure_mpa))


class RunLoad(RunReference, _Load):
    """A stored crank-dynamics run: its pressures (two strokes), or the pressure of a worst instant at all angles.

    The service fills in the data.
    """

    instant: Instant | None = Field(
        default=None, description="the instant whose pressure acts at all angles; null: all pressures of the cycle"
    )
    back_pressure_mpa: Finite | None = Field(default=None, description="null: the run's crankcase pressure")
    angle_deg: list[Finite] | None = Field(default=None, description="filled in from the run")
    pressure_mpa: list[Finite] | None = Field(default=None, description="filled in from the run")
    taken_from: str | None = Field(default=None, description="filled in: kind and hash of the run's own request")

    def filled(self, run: Run) -> Self:
        if self.instant is None:
            cycle = cycle_of(run)
            angle, pressure = cycle["angle_deg"], cycle["pressure_mpa"]
        else:
            worst = worst_of(run, self.instant)
            angle, pressure = [worst["angle_deg"]], [worst["pressure_mpa"]]
        back = self.back_pressure_mpa
        return self.model_copy(
            update={
                "back_pressure_mpa": run["spec"]["cylinder"]["crankcase_pressure_mpa"] if back is None else back,
                "angle_deg": angle,
                "pressure_mpa": pressure,
                "taken_from": source_of(run),
            }
        )

    def to_solver(self, mechanism: rod.Mechanism, piston: rod.Piston) -> rod.TableLoad | rod.ConstantLoad:
        if not self.angle_deg or not self.pressure_mpa:
            raise InvalidInput("load.run_id", "nothing was taken from the run", "a run of the same store")
        if self.instant is not None:
            return rod.ConstantLoad(self.pressure_mpa[0] * MEGA, _pascal(self.back_pressure_mpa))
        return rod.TableLoad(
            tuple(math.radians(a) for a in self.angle_deg),
            tuple(p * MEGA for p in self.pressure_mpa),
            _pascal(self.back_pressure_mpa),
        )


class IndicatorLoad(Diagram, _Load):
    """An indicator diagram of a two-stroke cycle for the piston's own bore, unrolled with the machine's kinematics."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "kind": "indicator",
                    "clearance_volume_cm3": 2.0,
                    "strokes": [
                        {"volume_cm3": [2.0, 2.25, 2.55, 2.942], "pressure_mpa": [2.4, 2.1, 1.8, 1.55]},
                        {"volume_cm3": [2.942, 2.55, 2.25, 2.0], "pressure_mpa": [1.5, 1.7, 2.0, 2.3]},
                    ],
                }
            ]
        }
    )
    clearance_volume_cm3: Volume = Field(default=0.0, description="volume at the top dead centre")
    back_pressure_mpa: Finite | None = Field(default=None, description="null: the mean of the cycle")

    def _sound(
        self, mechanism: rod.Mechanism, piston: rod.Piston
    ) -> tuple[IndicatorPressure, float, tuple[Repair, ...]]:
        with fields_of_load():
            diagram = self.diagram()
        clearance = self.clearance_volume_cm3 * CUBIC_CENTI
        if not self.repair:
            return diagram, clearance, ()
        sound, repairs = rod.mended(diagram, clearance, mechanism, piston)
        return sound, clearance, repairs

    def repairs(self, mechanism: rod.Mechanism, piston: rod.Piston) -> tuple[Repair, ...]:
        return self._sound(mechanism, piston)[2]

    def to_solver(self, mechanism: rod.Mechanism, piston: rod.Piston) -> rod.IndicatorLoad:
        diagram, clearance, _ = self._sound(mechanism, piston)
        return rod.IndicatorLoad(diagram, clearance, mechanism, piston, _pascal(self.back_pressure_mpa))


class CustomMaterial(Strict):
    elastic_modulus_gpa: Positive
    fatigue_limit_mpa: Positive = Field(description="fatigue limit of a smooth specimen in alternating bending")
    fatigue_reduction: float = Field(
        ge=1, le=100, description="K, fatigue reduction factor: notch, size and surface together"
    )
    mean_stress_sensitivity: float = Field(
        ge=0, lt=1, description="psi, mean stress sensitivity of Serensen's criterion"
    )
    yield_strength_mpa: Positive
    density_kg_m3: Positive
    poisson: float = Field(default=0.3, gt=-1, lt=0.5)
    ultimate_strength_mpa: Positive | None = Field(default=None, description="tensile strength, for Goodman and Gerber")
    loss_factor: float = Field(
        default=LOSS_FACTOR,
        ge=0,
        le=0.5,
        description="η, loss factor of the strip in its clamps: twice the damping ratio; 0: undamped",
    )

    def to_solver(self) -> rod.Material:
        return rod.Material(**si(self))


class CatalogueMaterial(Strict):
    name: Literal[tuple(rod.CATALOGUE)] = Field(description="name of a material in the catalogue")  # type: ignore[valid-type]

    def to_solver(self) -> rod.Material:
        return rod.CATALOGUE[self.name]


_LOADS = {
    "schmidt": SchmidtLoad,
    "table": TableLoad,
    "constant": ConstantLoad,
    "indicator": IndicatorLoad,
    "run": RunLoad,
}
_AnyLoad = one_named("kind", _LOADS)
_Material = listed_or_own(CatalogueMaterial, CustomMaterial)


class Dimensions(Strict):
    b_mm: Positive = Field(description="b, width")
    h_mm: Positive = Field(description="h, thickness in the plane of bending")
    l_mm: Positive = Field(description="l, free length; at most the rod's length")


class RodRequest(SolverRequest):
    """The machine, its load and its material."""

    mechanism: Mechanism
    piston: Piston
    load: _AnyLoad
    material: _Material
    fatigue_criterion: Literal[tuple(CRITERIA)] = Field(  # type: ignore[valid-type]
        default="serensen", description="fatigue criterion"
    )

    def contradictions(self) -> list[Entry]:
        return stuck(self.mechanism)

    def _machine(self) -> tuple[rod.Mechanism, rod.Piston]:
        return rod.Mechanism(**si(self.mechanism)), rod.Piston(**si(self.piston))

    def scene(self) -> rod.Scene:
        """The scene in SI units. Raises InvalidInput for input only the solver can reject."""
        mechanism, piston = self._machine()
        return rod.Scene(mechanism, piston, self.load.to_solver(mechanism, piston), self.material.to_solver())

    def repairs(self) -> tuple[Repair, ...]:
        """Repairs of the load's points, if requested."""
        return self.load.repairs(*self._machine())


class CheckRequest(RodRequest):
    """A check: given dimensions in a machine."""

    dimensions: Dimensions

    def contradictions(self) -> list[Entry]:
        found = super().contradictions()
        if self.dimensions.l_mm > self.mechanism.rod_length_mm:
            found.append(
                entry("/dimensions/l_mm", "the free length exceeds the rod", "at most mechanism.rod_length_mm")
            )
        return found

    def strip(self) -> rod.Dimensions:
        return rod.Dimensions(**si(self.dimensions))


class Requirements(Strict):
    """Minimum safeties and maximum loads on the piston's guide."""

    min_fatigue_safety: Positive = Field(default=1.0, description="safety factor against fatigue")
    min_stability_safety: float = Field(default=1.0, ge=1, le=1e6, description="safety factor against buckling")
    max_contact_pressure_mpa: Positive | None = Field(default=None, description="needs the effect friction")
    max_friction_power_w: Positive | None = Field(default=None, description="needs the effect friction")
    min_yield_safety: Positive | None = Field(
        default=None, description="safety factor against yield; null: no requirement, the verdict judges it by 1"
    )


Range = Annotated[list[Positive], Field(min_length=2, max_length=2, description="minimum and maximum")]


class RodBounds(Strict):
    b_mm: Range
    h_mm: Range
    l_mm: Range


class Steps(Strict):
    """Increments to which width and free length are rounded; null: not rounded."""

    b: Positive | None = None
    l: Positive | None = None


class DesignRequest(RodRequest, DesignSettings):
    """A design: requirements, bounds and objective."""

    requirements: Requirements = Requirements()
    bounds: RodBounds
    stock_h_mm: list[Positive] | None = Field(
        default=None, min_length=1, max_length=MAX_THICKNESSES, description="available thicknesses; null: any thickness"
    )
    step_mm: Steps = Steps()
    objective: Literal[tuple(rod.OBJECTIVES)] = "mass"  # type: ignore[valid-type]

    def contradictions(self) -> list[Entry]:
        found = super().contradictions()
        for name in ("b_mm", "h_mm", "l_mm"):
            low, high = getattr(self.bounds, name)
            if low > high:
                found.append(entry(f"/bounds/{name}", "the least exceeds the greatest", "at most the greatest"))
        if self.bounds.l_mm[0] > self.mechanism.rod_length_mm:
            found.append(entry("/bounds/l_mm", "starts beyond the rod's own length", "at most mechanism.rod_length_mm"))
        return found

    def problem(self) -> rod.RodProblem:
        """The design problem in SI units. Raises InvalidInput for input only the solver can reject."""
        b = self.bounds
        return rod.RodProblem(
            self.scene(),
            rod.Bounds(*(tuple(v * MILLI for v in pair) for pair in (b.b_mm, b.h_mm, b.l_mm))),
            rod.Requirements(**si(self.requirements)),
            rod.OBJECTIVES[self.objective],
            stock_h=None if self.stock_h_mm is None else tuple(h * MILLI for h in self.stock_h_mm),
            step_b=None if self.step_mm.b is None else self.step_mm.b * MILLI,
            step_l=None if self.step_mm.l is None else self.step_mm.l * MILLI,
        )
