"""Machines that several tests of the crank share."""

from __future__ import annotations

import math

from solvers.crank.gas.indicator_diagram import IndicatorPressure, Stroke
from solvers.crank.gas.pressure_table import TablePressure
from solvers.crank.masses.two_mass_model import CrankThrow, RodMass
from solvers.crank.scene import Cylinder, Engine, Masses, Mechanism, Scene
from tests.solvers.crank.cycles import four_stroke, stirling

CAR = Mechanism(crank_radius=0.04, rod_length=0.14, speed=50.0)
CYLINDER = Cylinder(bore=0.08, clearance_volume=math.pi * 0.08**2 / 4 * 0.08 / 9.0, crankcase_pressure=0.1e6, strokes=4)
ROD = RodMass(length=0.14, mass=0.6, cg_from_pin=0.1, inertia=0.0020)
MASSES = Masses(0.45, ROD, CrankThrow(0.4, 0.7, 0.02, 0.5, 0.03))


def diagram() -> IndicatorPressure:
    return IndicatorPressure(
        tuple(Stroke(tuple(v.tolist()), tuple(p.tolist())) for v, p in four_stroke(CAR, CYLINDER, 900.0))
    )


def car(**parts: object) -> Scene:
    """A car's cylinder on its indicator diagram."""
    return Scene(**{"mechanism": CAR, "cylinder": CYLINDER, "pressure": diagram(), "masses": MASSES, **parts})


def cooler(**parts: object) -> Scene:
    """A Stirling machine on a table of one turn."""
    angle, pressure = stirling()
    table = TablePressure(tuple(math.radians(a) for a in angle), tuple(p * 1e6 for p in pressure))
    scene = {
        "mechanism": Mechanism(0.0015, 0.0455, 50.0),
        "cylinder": Cylinder(0.02, 1e-6, 1.8e6, 2),
        "pressure": table,
        "masses": Masses(0.05, RodMass(0.0455, 0.01, 0.03, 1e-6), CrankThrow()),
    }
    return Scene(**{**scene, **parts})


def in_line(cylinders: int, order: tuple[int, ...]) -> Engine:
    """A four-stroke in-line engine; ``order`` is the firing order, evenly spaced."""
    step = 4.0 * math.pi / cylinders
    phases = [0.0] * cylinders
    for place, number in enumerate(order):
        phases[number - 1] = place * step
    return Engine(tuple(phases), (0.0,) * cylinders, tuple(0.09 * i for i in range(cylinders)))
