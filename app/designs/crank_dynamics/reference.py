"""Reference solutions of crank dynamics, from ``solvers.references.crank``."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from app.designs.crank_dynamics.request import DynamicsRequest
from app.designs.independent import active, exact, reference
from app.designs.kind import Answer
from app.designs.units import by_solver_name
from solvers import crank
from solvers.accuracy import Exact, Reference

MAIN_RESULTS = (
    "mean_torque_nm", "indicated_power_w", "work_fluctuation_j", "rod_compression_max_n", "side_force_max_n",
    "wrist_pin_load_max_n", "crank_pin_load_max_n", "main_bearing_load_max_n",
)  # fmt: skip
"""Results judged by an accuracy study, all of which the reference has."""
_NAMES = by_solver_name(*MAIN_RESULTS)


def dynamics_reference(request: DynamicsRequest, answer: Answer) -> Reference:
    """All main results of an analysis, with the effects of the answer."""

    def results(watch: Callable[[], None]) -> dict[str, Exact]:
        # imported here because only studies need arbitrary precision
        from solvers.references.crank import cycle

        scene, _ = request.scene()
        return exact(cycle(_case(scene, active(answer)), watch), _NAMES)

    return reference("Pythagoras, the diagram's antiderivative and the kinetic energy", results)


def _case(scene: crank.Scene, effects: frozenset[str]) -> dict[str, Any]:
    m, c, w = scene.mechanism, scene.cylinder, scene.masses
    left_out = {"reciprocating_inertia", "rod_inertia_couple"} - effects
    if w.rod.inertia is None:
        left_out.add("rod_inertia_couple")
    pressure = scene.pressure
    if isinstance(pressure, crank.TablePressure):
        source = {"kind": "table", "angle": pressure.angle, "pressure": pressure.pressure}
    else:
        strokes = [{"volume": s.volume, "pressure": s.pressure} for s in pressure.strokes]
        source = {"kind": "indicator", "strokes": strokes}
    phases = scene.engine.phases if "engine" in effects else (0.0,)
    return {
        "mechanism": {
            "crank_radius": m.crank_radius,
            "rod_length": m.rod_length,
            "speed": m.speed,
            "offset": m.offset if "pin_offset" in effects else 0.0,
        },
        "cylinder": {
            "bore": c.bore,
            "clearance_volume": c.clearance_volume,
            "crankcase_pressure": c.crankcase_pressure,
            "strokes": c.strokes,
        },
        "masses": {
            "piston": w.piston,
            "rod": w.rod.mass,
            "rod_cg": w.rod.cg_from_pin,
            "rod_inertia": w.rod.inertia or 0.0,
            "crank_pin": w.throw.at_crank_pin(m.crank_radius),
        },
        "rods_per_pin": w.rods_per_pin,
        "pressure": source,
        "phases": [phase % (c.strokes * math.pi) for phase in phases],
        "left_out": left_out,
    }
