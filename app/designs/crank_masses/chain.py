"""Hand calculation of a rod's masses: from periods, scale readings, or by estimate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.designs.calculation.chain import DEGREE, Chain

LABORATORY = "laboratory work on the masses of the crank mechanism (pendulum method)"
PENDULUM = "physical pendulum: any text on mechanics; the amplitude by Gauss's arithmetic-geometric mean"
TWO_MASSES = "C. F. Taylor: The Internal-Combustion Engine in Theory and Practice II, two-mass model"


def calculation(run: Mapping[str, Any], chain: Chain) -> None:
    """Add the calculation of an analysis. Raises NotANumber."""
    spec, result = run["spec"], run["result"]
    {"pendulum": _pendulum, "weighing": _weighing, "estimate": _estimate}[spec["method"]](chain, spec, result)


def _swing(c: Chain, spec: Mapping[str, Any], ends: tuple[tuple[str, str, str], ...]) -> None:
    """Equivalent simple-pendulum lengths; ``ends``: subscript, label, field of the period."""
    import math

    c.given("g", "gravity", spec["gravity_m_s2"], "m/s²")
    swung = spec["amplitude_deg"] > 0.0
    if swung:
        c.given("theta", "amplitude", math.radians(spec["amplitude_deg"]), DEGREE)
        c.step("a_1", "(1 + cos(theta / 2)) / 2", "first means of 1 and cos θ/2: arithmetic", "", PENDULUM, digits=10)
        c.step("b_1", "sqrt(cos(theta / 2))", "geometric", "", PENDULUM, digits=10)
        c.step("q", "(a_1 + b_1) / 4 + sqrt(a_1 * b_1) / 2", "their common mean, third round", "", PENDULUM, digits=10)
    for n, words, field in ends:
        c.given(f"T_{n}", f"period, hung at the {words}", spec[field], "s")
        period = f"(T_{n} * q)" if swung else f"T_{n}"
        formula = f"1000 * g * {period}**2 / (4 * pi**2)"
        c.step(f"A_{n}", formula, "length of the simple pendulum", "mm", PENDULUM, digits=10)


def _shared(c: Chain, result: Mapping[str, Any], arm: str) -> None:
    """Mass shares and inertia; ``arm``: distance of the centre of mass from the knife edge."""
    reported = result["rod_mass_at_pin_kg"]
    c.step("m_A", "m_r * (L - l_A) / L", "share at the wrist pin", "kg", TWO_MASSES, reported)
    c.step("m_B", "m_r * l_A / L", "share at the crank pin", "kg", TWO_MASSES, result["rod_mass_at_crank_kg"])
    formula = f"m_r * {arm} * (A_C - {arm}) * 1e-6"
    c.step("J_0", formula, "inertia about the centre of mass", "kg·m²", PENDULUM, result["rod_inertia_kg_m2"])
    formula = "m_r * l_A * (L - l_A) * 1e-6 - J_0"
    reported = result["inertia_defect_kg_m2"]
    c.step("Delta_J", formula, "what two masses have too much of it", "kg·m²", TWO_MASSES, reported)


def _pendulum(c: Chain, spec: Mapping[str, Any], result: Mapping[str, Any]) -> None:
    c.title("What was measured")
    c.given("L_0", "distance of the knife edges", spec["pivot_distance_mm"], "mm")
    c.given("m_r", "mass of the rod", spec["rod_mass_kg"], "kg")
    c.given("r_C", "radius of the small end's bore at the edge", spec["small_end_bore_radius_mm"], "mm")
    c.given("r_D", "radius of the big end's bore at the edge", spec["big_end_bore_radius_mm"], "mm")
    c.title("Two pendulums")
    _swing(c, spec, (("C", "small end", "period_small_end_s"), ("D", "big end", "period_big_end_s")))
    c.title("Centre of mass and shares")
    formula = "L_0 * (A_D - L_0) / (A_C + A_D - 2 * L_0)"
    c.step("l_0", formula, "small end's edge to the centre of mass", "mm", LABORATORY, digits=9)
    c.step(
        "l_A", "l_0 - r_C", "wrist pin to the centre of mass", "mm", LABORATORY, result["rod_cg_from_pin_mm"], digits=9
    )
    c.step("L", "L_0 - r_C - r_D", "length between the pins", "mm", LABORATORY)
    _shared(c, result, "l_0")
    c.title("How far to trust it")
    formula = "L_0 * ((A_D + 0.002 * A_D) - L_0) / (1.002 * (A_C + A_D) - 2 * L_0) - l_0"
    c.step("Delta_l", formula, "what +0.1 % in both periods moves the centre of mass by", "mm", LABORATORY)


def _weighing(c: Chain, spec: Mapping[str, Any], result: Mapping[str, Any]) -> None:
    c.title("What was measured")
    c.given("L", "distance of the supports: the pins' centres", spec["length_mm"], "mm")
    c.given("m_C", "reading at the small end", spec["small_end_reading_kg"], "kg")
    c.given("m_D", "reading at the big end", spec["big_end_reading_kg"], "kg")
    c.title("Centre of mass and shares")
    c.step("m_r", "m_C + m_D", "mass of the rod", "kg", reported=result["rod_mass_kg"])
    reported = result["rod_cg_from_pin_mm"]
    c.step("l_A", "L * m_D / (m_C + m_D)", "wrist pin to the centre of mass", "mm", TWO_MASSES, reported)
    if spec["period_small_end_s"] is None:
        reported = result["rod_mass_at_pin_kg"]
        c.step("m_A", "m_r * (L - l_A) / L", "share at the wrist pin", "kg", TWO_MASSES, reported)
        c.step("m_B", "m_r * l_A / L", "share at the crank pin", "kg", TWO_MASSES, result["rod_mass_at_crank_kg"])
        return
    c.given("r_C", "radius of the small end's bore at the edge", spec["small_end_bore_radius_mm"], "mm")
    _swing(c, spec, (("C", "small end", "period_small_end_s"),))
    c.step("l_0", "l_A + r_C", "edge to the centre of mass", "mm")
    _shared(c, result, "l_0")


def _estimate(c: Chain, spec: Mapping[str, Any], result: Mapping[str, Any]) -> None:
    c.title("Constructive masses of an existing engine")
    c.given("D", "cylinder bore", spec["bore_mm"], "mm")
    c.given("mu_p", "piston group per piston area", spec["piston_kg_m2"], "kg/m²")
    c.given("mu_r", "rod per piston area", spec["rod_kg_m2"], "kg/m²")
    c.step("A", "pi * D**2 / 4 * 1e-6", "piston area", "m²")
    c.step("m_p", "mu_p * A", "piston group", "kg", LABORATORY, result["piston_mass_kg"])
    c.step("m_r", "mu_r * A", "rod", "kg", LABORATORY, result["rod_mass_kg"])
