"""Requests of crank dynamics in the units of the API, and their conversion to SI."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from app.designs.schema import (
    WHOLE,
    Entry,
    Finite,
    NotNegative,
    Positive,
    SolverRequest,
    Strict,
    entry,
    one_named,
    one_of,
)
from app.designs.units import MEGA, MILLI, si
from solvers import crank

CUBIC_CENTI = 1e-6
MAX_POINTS = 10_000


Volume = Annotated[float, Field(ge=0, le=1e9)]
"""cm³; a marine engine's cylinder has two million"""


class Mechanism(Strict):
    crank_radius_mm: Positive = Field(description="r, crank radius; less than the rod's length")
    rod_length_mm: Positive = Field(description="L, wrist pin to crank pin")
    speed_hz: Positive = Field(description="revolutions per second")
    offset_mm: Finite = Field(
        default=0.0,
        description="distance of the cylinder axis from the shaft, positive toward the side to which the crank "
        "turns from the top; angles then count from the crank parallel to the cylinder axis",
    )


class Cylinder(Strict):
    bore_mm: Positive
    clearance_volume_cm3: Volume = Field(default=0.0, description="volume at the top dead centre")
    crankcase_pressure_mpa: Finite = Field(default=0.1, description="crankcase pressure, below the piston")
    strokes: Annotated[Literal[2, 4], WHOLE] = Field(description="strokes per cycle")


class TablePressure(Strict):
    """Pressures at crank angles of one cycle, joined by a monotone periodic cubic."""

    kind: Literal["table"]
    angle_deg: list[Finite] = Field(min_length=3, max_length=MAX_POINTS, description="ascending, within one cycle")
    pressure_mpa: list[Finite] = Field(min_length=3, max_length=MAX_POINTS, description="one per angle")
    repair: bool = Field(default=False, description="repair faulty points and report each repair")

    def to_solver(
        self, cylinder: crank.Cylinder, mechanism: crank.Mechanism
    ) -> tuple[crank.TablePressure, tuple[crank.Repair, ...]]:
        table = crank.TablePressure(
            tuple(math.radians(a) for a in self.angle_deg), tuple(p * MEGA for p in self.pressure_mpa)
        )
        return crank.repaired_table(table, cylinder) if self.repair else (table, ())


class Stroke(Strict):
    """The points of one stroke; volumes with the clearance volume, in either order."""

    volume_cm3: list[Volume] = Field(min_length=2, max_length=MAX_POINTS)
    pressure_mpa: list[Finite] = Field(min_length=2, max_length=MAX_POINTS, description="one per volume")


class Diagram(Strict):
    """An indicator diagram, stroke by stroke."""

    kind: Literal["indicator"]
    strokes: list[Stroke] = Field(
        min_length=2,
        max_length=4,
        description="four strokes: intake, compression, expansion, exhaust; two strokes: expansion, compression",
    )
    repair: bool = Field(default=False, description="repair faulty points and report each repair")

    def diagram(self) -> crank.IndicatorPressure:
        """The points as sent, in SI units."""
        return crank.IndicatorPressure(
            tuple(
                crank.Stroke(tuple([v * CUBIC_CENTI for v in s.volume_cm3]), tuple([p * MEGA for p in s.pressure_mpa]))
                for s in self.strokes
            )
        )


class IndicatorPressure(Diagram):
    """An indicator diagram of the cylinder."""

    def to_solver(
        self, cylinder: crank.Cylinder, mechanism: crank.Mechanism
    ) -> tuple[crank.IndicatorPressure, tuple[crank.Repair, ...]]:
        diagram = self.diagram()
        return crank.repaired_indicator(diagram, cylinder, mechanism.motion) if self.repair else (diagram, ())


_PRESSURES = {"table": TablePressure, "indicator": IndicatorPressure}
_Pressure = one_named("kind", _PRESSURES)


class Masses(Strict):
    piston_kg: NotNegative = Field(description="mass of the piston group: piston, rings, wrist pin")
    rod_kg: NotNegative
    rod_cg_from_pin_mm: NotNegative = Field(description="distance from the wrist pin to the rod's centre of mass")
    rod_inertia_kg_m2: NotNegative | None = Field(
        default=None, description="moment of inertia about the centre of mass; null: that of the two-mass model"
    )
    crank_pin_kg: NotNegative = 0.0
    web_kg: NotNegative = Field(default=0.0, description="mass of one of the throw's two webs")
    web_radius_mm: NotNegative = 0.0
    counterweight_kg: NotNegative = Field(default=0.0, description="mass of all counterweights of the throw together")
    counterweight_radius_mm: NotNegative = 0.0
    rods_per_pin: Annotated[Literal[1, 2], WHOLE] = Field(
        default=1, description="rods per crank pin: 2 where the rods of a V engine share one"
    )


def _form_of_bank(value: Any) -> str | None:
    if isinstance(value, (list, tuple)):
        return "axes"
    return "angle" if isinstance(value, (int, float)) and not isinstance(value, bool) else None


_Bank = one_of(_form_of_bank, {"angle": Finite, "axes": list[Finite]}, "a number, or one number per cylinder")


class Engine(Strict):
    """Several like cylinders on one shaft."""

    cylinders: int = Field(ge=1, le=64)
    phases_deg: list[Finite] = Field(
        min_length=1, max_length=64, description="crank angle by which each cylinder's cycle follows the first one's"
    )
    bank_deg: _Bank = Field(
        default=0.0,
        description="V angle, with cylinders alternately left and right; or the direction of every cylinder",
    )
    positions_mm: list[Finite] | None = Field(
        default=None,
        max_length=64,
        description="distance between cylinders along the shaft; null: couples are not computed",
    )
    flywheel_inertia_kg_m2: NotNegative = 0.0
    wanted_irregularity: float | None = Field(
        default=None,
        ge=1e-9,
        le=1,
        description="coefficient of speed fluctuation, (maximum - minimum speed)/mean speed; the flywheel that "
        "it requires is computed",
    )

    def to_solver(self) -> crank.Engine:
        if isinstance(self.bank_deg, list):
            axes = [math.radians(a) for a in self.bank_deg]
        else:
            axes = [math.radians((0.5 if i % 2 else -0.5) * self.bank_deg) for i in range(len(self.phases_deg))]
        return crank.Engine(
            tuple(math.radians(p) for p in self.phases_deg),
            tuple(axes),
            tuple(x * MILLI for x in self.positions_mm or ()),
            self.flywheel_inertia_kg_m2,
            self.wanted_irregularity,
        )


class DynamicsRequest(SolverRequest):
    """A crank mechanism, its masses, and the pressure that drives it."""

    mechanism: Mechanism
    cylinder: Cylinder
    pressure: _Pressure
    masses: Masses
    engine: Engine | None = None
    series_angles: int = Field(default=360, ge=2, le=3600, description="number of equally spaced angles in the series")

    def contradictions(self) -> list[Entry]:
        found = stuck(self.mechanism)
        if self.masses.rod_cg_from_pin_mm > self.mechanism.rod_length_mm:
            found.append(
                entry(
                    "/masses/rod_cg_from_pin_mm",
                    "the centre of mass lies outside the rod",
                    "at most mechanism.rod_length_mm",
                )
            )
        if self.engine is not None:
            found += _of_engine(self.engine)
        return found

    def scene(self) -> tuple[crank.Scene, tuple[crank.Repair, ...]]:
        """The scene in SI units, and the repairs. Raises InvalidInput for input only the solver can reject."""
        mechanism, cylinder = crank.Mechanism(**si(self.mechanism)), crank.Cylinder(**si(self.cylinder))
        w = self.masses
        rod = crank.RodMass(mechanism.rod_length, w.rod_kg, w.rod_cg_from_pin_mm * MILLI, w.rod_inertia_kg_m2)
        throw = crank.CrankThrow(
            w.crank_pin_kg, w.web_kg, w.web_radius_mm * MILLI, w.counterweight_kg, w.counterweight_radius_mm * MILLI
        )
        masses = crank.Masses(w.piston_kg, rod, throw, w.rods_per_pin)
        pressure, repairs = self.pressure.to_solver(cylinder, mechanism)
        parts: dict[str, Any] = {} if self.engine is None else {"engine": self.engine.to_solver()}
        return crank.Scene(mechanism, cylinder, pressure, masses, **parts), repairs


def stuck(mechanism: Mechanism) -> list[Entry]:
    """The entry for a crank that cannot turn."""
    if mechanism.crank_radius_mm < mechanism.rod_length_mm:
        return []
    why = "the crank is not shorter than the rod, so the mechanism cannot turn"
    return [entry("/mechanism/crank_radius_mm", why, "less than mechanism.rod_length_mm")]


def _of_engine(engine: Engine) -> list[Entry]:
    found, allowed = [], "as many as engine.cylinders"
    lists: dict[str, list[float] | BaseModel | float | None] = {
        "phases_deg": engine.phases_deg,
        "bank_deg": engine.bank_deg,
        "positions_mm": engine.positions_mm,
    }
    for name, value in lists.items():
        if isinstance(value, list) and len(value) != engine.cylinders:
            found.append(entry(f"/engine/{name}", f"has {len(value)} entries", allowed))
    return found
