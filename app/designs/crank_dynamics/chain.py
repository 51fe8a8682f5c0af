"""Hand calculation of the crank mechanism: reduced masses, motion, and forces at the instants of maximum load. N, mm,
MPa."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from app.designs.calculation.chain import DEGREE, Chain, Column
from app.designs.crank_dynamics.request import DynamicsRequest

TAYLOR = "C. F. Taylor: The Internal-Combustion Engine in Theory and Practice II"
LECTURES = "university lectures on the dynamics of the crank mechanism; docs/theory/crank-dynamics.md"
FOLLOWED = ("reciprocating_inertia", "rod_inertia_couple", "pin_offset", "engine")
INSTANTS = {
    "gas_force_max": "gas force",
    "rod_compression_max": "rod's compression",
    "rod_tension_max": "rod's tension",
    "side_force_max": "side force",
    "wrist_pin_load_max": "load of the wrist pin",
    "crank_pin_load_max": "load of the crank pin",
    "main_bearing_load_max": "load of the main bearings",
}
_SHOWN = "rod_compression_max"


def calculation(run: Mapping[str, Any], chain: Chain) -> None:
    """Add the calculation of an analysis. Raises NotANumber."""
    _Crank(run, chain)


class _Crank:
    def __init__(self, run: Mapping[str, Any], chain: Chain) -> None:
        self.request = DynamicsRequest.model_validate(run["spec"])
        self.result: Mapping[str, Any] = run["result"]
        active = {e["name"] for e in run["effects"] if e["state"] == "active"}
        self.inertia = "reciprocating_inertia" in active
        self.couple = "rod_inertia_couple" in active and self.request.masses.rod_inertia_kg_m2 is not None
        self.offset = "pin_offset" in active and self.request.mechanism.offset_mm != 0.0
        self.chain = chain
        self._begin()
        self._masses()
        self._instant(next(w for w in self.result["worst"] if w["name"] == _SHOWN))
        self._instants()
        self._whole()

    def _begin(self) -> None:
        c, q = self.chain, self.request
        c.title("What is given")
        c.given("r", "crank radius", q.mechanism.crank_radius_mm, "mm")
        c.given("L", "rod length", q.mechanism.rod_length_mm, "mm")
        if self.offset:
            c.given("e", "offset of the cylinder axis", q.mechanism.offset_mm, "mm")
        c.given("f", "turns per second", q.mechanism.speed_hz, "1/s")
        c.given("D", "cylinder bore", q.cylinder.bore_mm, "mm")
        c.given("p_c", "pressure in the crankcase", q.cylinder.crankcase_pressure_mpa, "MPa")
        c.title("Machine")
        c.step("lam", "r / L", "ratio of crank and rod", source=TAYLOR)
        c.step("omega", "2 * pi * f", "angular speed", "1/s")
        c.step("A", "pi * D**2 / 4", "piston area", "mm²")
        reported = self.result["stroke_mm"]
        if self.offset:
            c.step("s", "sqrt((L + r)**2 - e**2) - sqrt((L - r)**2 - e**2)", "stroke", "mm", LECTURES, reported)
        else:
            c.step("s", "2 * r", "stroke", "mm", TAYLOR, reported)

    def _masses(self) -> None:
        c, m, r = self.chain, self.request.masses, self.result
        c.title("Masses, reduced to the two pins")
        c.given("m_p", "piston group", m.piston_kg, "kg")
        c.given("m_r", "rod", m.rod_kg, "kg")
        c.given("l_A", "wrist pin to the rod's centre of mass", m.rod_cg_from_pin_mm, "mm")
        c.step("m_A", "m_r * (L - l_A) / L", "the rod's share at the wrist pin", "kg", TAYLOR, r["rod_mass_at_pin_kg"])
        c.step("m_B", "m_r * l_A / L", "at the crank pin", "kg", TAYLOR, r["rod_mass_at_crank_kg"])
        c.step("m_j", "m_p + m_A", "mass that goes to and fro", "kg", TAYLOR, r["reciprocating_mass_kg"])
        c.given("m_cp", "crank pin", m.crank_pin_kg, "kg")
        c.given("m_w", "one web", m.web_kg, "kg")
        c.given("rho_w", "radius of its centre of mass", m.web_radius_mm, "mm")
        c.given("m_cw", "counterweights", m.counterweight_kg, "kg")
        c.given("rho_cw", "radius of their centre of mass", m.counterweight_radius_mm, "mm")
        c.step("m_k", "m_cp + (2 * m_w * rho_w - m_cw * rho_cw) / r", "the throw, at the crank pin", "kg", LECTURES)
        rods = "2 * m_B" if m.rods_per_pin == 2 else "m_B"
        c.step("m_rot", f"m_k + {rods}", "mass that turns", "kg", LECTURES, r["rotating_mass_kg"])
        if m.rod_inertia_kg_m2 is not None:
            c.given("J_0", "the rod's moment of inertia", m.rod_inertia_kg_m2, "kg·m²")
            reported = r["inertia_defect_kg_m2"]
            formula = "m_r * l_A * (L - l_A) * 1e-6 - J_0"
            c.step("Delta_J", formula, "what two masses have too much of it", "kg·m²", TAYLOR, reported)

    # One instant with all numbers, then all of them in a table --------------------------------------------------------

    @property
    def _formulas(self) -> list[tuple[str, str, str, str]]:
        """Symbol, formula, label and unit of everything that follows from angle and pressure."""
        found = [
            (
                "beta",
                "asin(lam * sin(phi) - e / L)" if self.offset else "asin(lam * sin(phi))",
                "angle of the rod",
                DEGREE,
            ),
            ("P_g", "(p - p_c) * A", "gas force", "N"),
        ]
        bent = "cos(phi) - sin(phi) * tan(beta) + lam * cos(phi)**2 / cos(beta)**3"
        found.append(("a", f"r * omega**2 / 1000 * ({bent})", "acceleration of the piston", "m/s²"))
        found.append(("P", "P_g - m_j * a" if self.inertia else "P_g", "axial force on the mechanism", "N"))
        if self.couple:
            found.append(("b", "lam * cos(phi) / cos(beta)", "first derivative of the rod's angle", ""))
            turned = "(b**2 * sin(beta) - lam * sin(phi)) / cos(beta)"
            found.append(("eta", turned, "second derivative", ""))
            more = "1000 * Delta_J * eta * omega**2 / (L * cos(beta))"
            found.append(("N", f"P * tan(beta) + {more}", "side force, with the rod's true inertia", "N"))
        else:
            found.append(("N", "P * tan(beta)", "side force", "N"))
        found.append(("T", "P * sin(phi) + N * cos(phi)", "tangential force", "N"))
        found.append(("Z", "P * cos(phi) - N * sin(phi)", "radial force, toward the shaft", "N"))
        return found

    def _instant(self, worst: Mapping[str, Any]) -> None:
        c = self.chain
        c.title("The instant at which the rod is pressed most")
        c.given("phi", "crank angle, found by the run", math.radians(worst["angle_deg"]), DEGREE)
        c.given("p", "pressure there, from the diagram", worst["pressure_mpa"], "MPa")
        for symbol, formula, words, unit in self._formulas:
            c.step(symbol, formula, words, unit, LECTURES if symbol in ("b", "eta") else TAYLOR)
        c.step("S", "P * cos(beta) + N * sin(beta)", "force along the rod", "N", TAYLOR, worst["force_n"])
        c.step("S_TZ", "T * sin(phi + beta) + Z * cos(phi + beta)", "the same from its parts at the crank pin", "N")
        c.step("M", "T * r / 1000", "torque of this cylinder", "N·m", TAYLOR)

    def _instants(self) -> None:
        c, worst = self.chain, list(self.result["worst"])
        c.title("The same at every instant that loads a part")
        rows = ", ".join(f"{INSTANTS[w['name']]}: {k}" for k, w in enumerate(worst))
        c.remark(rows)
        # symbols with the row number as subscript; the formulas are those above
        columns = [Column("phi", "angle", DEGREE), Column("p", "pressure", "MPa")]
        columns += [Column(symbol, words, unit, formula) for symbol, formula, words, unit in self._formulas]
        c.table(columns, [(math.radians(w["angle_deg"]), w["pressure_mpa"]) for w in worst])
        c.step("K_B", "m_B * r * omega**2 / 1000", "centrifugal force of the rod's share", "N", TAYLOR)
        c.step("K_rot", "m_rot * r * omega**2 / 1000", "of all that turns", "N", TAYLOR)
        for k, w in enumerate(worst):
            formula = {
                "gas_force_max": f"P_g_{k}",
                "rod_compression_max": f"P_{k} * cos(beta_{k}) + N_{k} * sin(beta_{k})",
                "rod_tension_max": f"-(P_{k} * cos(beta_{k}) + N_{k} * sin(beta_{k}))",
                "side_force_max": f"abs(N_{k})",
                "wrist_pin_load_max": f"sqrt((P_g_{k}{f' - m_p * a_{k}' if self.inertia else ''})**2 + N_{k}**2)",
                "crank_pin_load_max": f"sqrt(T_{k}**2 + (Z_{k} - K_B)**2)",
                "main_bearing_load_max": f"sqrt(T_{k}**2 + (Z_{k} - K_rot)**2)",
            }[w["name"]]
            c.step(f"F_{k}", formula, f"greatest {INSTANTS[w['name']]}", "N", TAYLOR, w["force_n"])

    def _whole(self) -> None:
        c, r = self.chain, self.result
        c.title("The cycle as a whole")
        c.given("P_i", "indicated power, the cycle's integral (the run)", r["indicated_power_w"], "W")
        c.step("M_m", "P_i / omega", "mean torque: inertia does no work", "N·m", TAYLOR, r["mean_torque_nm"])
        if r["irregularity"] is not None:
            c.given("W", "work between the extremes of the speed (the run)", r["work_fluctuation_j"], "J")
            c.given("J", "the shaft's inertia (the run)", r["shaft_inertia_kg_m2"], "kg·m²")
            c.step(
                "delta", "W / (J * omega**2)", "irregularity of the speed", source=TAYLOR, reported=r["irregularity"]
            )
