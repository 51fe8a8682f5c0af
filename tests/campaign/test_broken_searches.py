"""Competitors detect deliberately broken searches: a wrong law, one-directional cones, a truncated range."""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np
import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from bench.campaign.designs import Design, judge_problem
from bench.campaign.linkage_designs import LinkageProblem
from bench.campaign.pin_designs import PinProblem
from bench.campaign.rivalry import Problem
from bench.campaign.rod_designs import RodProblem
from solvers.linkage import KINDS as TYPES
from solvers.linkage.optimum.family import Family
from solvers.pin.section.flexibility import cowper
from solvers.pin.shapes import cone as cones
from solvers.pin.shapes import stepped
from solvers.pin.shapes.break_points import half as halves
from solvers.pin.shapes.break_points import part
from solvers.pin.shapes.break_points.cells import lines_below

rod_design = importlib.import_module("solvers.rod.optimum.strip_search")

MATERIAL = {"allowable_stress_mpa": 150.0, "elastic_modulus_gpa": 210.0, "poisson": 0.3, "density_kg_m3": 7850.0}
PAPERS = {
    "geometry": {"outer_diameter_mm": 21.99, "boss_length_mm": 24.0, "small_end_length_mm": 30.0, "gap_mm": 1.0},
    "load": {"force_n": 15e3}, "material": MATERIAL,
}  # fmt: skip
SHORT = {
    "geometry": {"outer_diameter_mm": 30.0, "boss_length_mm": 6.0, "small_end_length_mm": 24.0, "gap_mm": 0.5},
    "load": {"force_n": 12e3}, "material": MATERIAL,
}  # fmt: skip
BLOW = {
    "restitution": 0.0739, "blow_frequency_hz": 5.83, "impact_speed_m_s": 1.2237, "impact_energy_j": 0.375,
    "limits": {"transmission_angle_deg": None},
}  # fmt: skip


def judged(slug: str, problem: Problem, accuracy: float = 1e-6) -> Design:
    return judge_problem(slug, problem, accuracy, np.random.default_rng(1), quick=True)


def pin_of(body, form, **limits):
    return PinProblem({**body, "form": form, "limits": limits})


class Alone(PinProblem):
    """Without neighbours: with a wrong model their searches end at their limits only."""

    def neighbours(self, steps):
        return iter(())

    def wider(self):
        return iter(())


def stand(found: Design) -> bool:
    return found.admissible and found.bounded and found.unbeaten and found.honest and found.nested


def test_the_papers_pin_is_not_beaten():
    found = judged("pin-profile", pin_of(PAPERS, {"kind": "stepped", "steps": 2}, max_deflection_um=8.4))
    assert stand(found) and found.neighbours >= 2 and abs(found.closest) < 1e-5


def test_a_wrong_pin_model_is_covered_by_the_gap_or_detected(monkeypatch):
    """Shear compliance 10 % too high in the walls of steps, so that part of the limit is unused; and in their bound."""
    problem = Alone(pin_of(PAPERS, {"kind": "stepped", "steps": 2}, max_deflection_um=9.5).body)
    true, soft = halves.Segments, cowper(MATERIAL["poisson"])
    soft = soft._replace(a=1.1 * soft.a, b=1.1 * soft.b)
    monkeypatch.setattr(halves, "Segments", lambda *given: true(*given)._replace(law=soft))
    owned = judged("pin-profile", problem)
    assert owned.closest < -1e-3 and owned.bounded
    monkeypatch.setattr(part, "lines_below", lambda *given: lines_below(*given[:-1], soft))
    found = judged("pin-profile", problem)
    assert not found.bounded and not found.unbeaten and found.better > 1e-3


def test_missing_widening_cones_are_detected(monkeypatch):
    problem = pin_of(SHORT, {"kind": "double_cone"})
    assert stand(judged("pin-profile", problem))
    monkeypatch.setattr(cones, "WIDENING", cones.NARROWING)
    assert judged("pin-profile", problem).better > 1e-2


def test_a_bushing_with_too_few_steps_is_detected(monkeypatch):
    geometry = {k: v for k, v in PAPERS["geometry"].items() if k != "outer_diameter_mm"}
    body = {**PAPERS, "geometry": geometry, "variable": "outer", "bore_mm": 12.0}
    problem = pin_of(body, {"kind": "stepped", "steps": 3}, max_deflection_um=8.0)
    assert stand(judged("pin-profile", problem))
    right = stepped.lightest_steps
    monkeypatch.setattr(stepped, "lightest_steps", lambda half, steps, *given: right(half, steps - 1, *given))
    found = judged("pin-profile", problem)
    assert not found.bounded and found.better > 1e-5


@pytest.mark.parametrize("objective", ["pin_force", "peak_torque"])
def test_a_linkage_is_not_beaten(objective):
    found = judged("impact-linkage", LinkageProblem({**BLOW, "types": list(TYPES), "objective": objective}, 0.0739))
    assert stand(found)


def test_a_truncated_range_is_detected(monkeypatch):
    body = {**BLOW, "types": ["largest_rocker"], "objective": "pin_force"}
    monkeypatch.setattr(Family, "proof_range", Family.design_range)
    found = judged("impact-linkage", LinkageProblem(body, 0.0739))
    assert not found.bounded and found.better > 1e-4


def test_truncated_bounds_of_a_rod_are_detected(monkeypatch):
    """The design search covers widths only up to 90 % of the bound."""
    example = KINDS["flexible-rod"].example(Mode.DESIGN)
    machine = {name: example[name] for name in ("mechanism", "piston", "load", "material")}
    core = {"include": ["beam_column", "friction"]}
    core["exclude"] = [e.name for e in KINDS["flexible-rod"].known_effects if e.name not in core["include"]]
    body = {**machine, "bounds": example["bounds"], "objective": "mass", "effects": core}
    problem = RodProblem({**body, "requirements": {"min_fatigue_safety": 2.4, "min_stability_safety": 1.8}}, machine)
    assert stand(judged("flexible-rod", problem, 1e-4))
    sizes = rod_design.Sizes

    def cut(bounds, *more):
        return sizes(replace(bounds, b=(bounds.b[0], 0.9 * bounds.b[1])), *more)

    monkeypatch.setattr(rod_design, "Sizes", cut)
    found = judged("flexible-rod", problem, 1e-4)
    assert not found.unbeaten and not found.bounded
