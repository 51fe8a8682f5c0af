"""Hand calculation of the strip: gas force, beam-column bending, stress, fatigue, stability, contact. N, mm, MPa."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from app.designs.calculation.chain import DEGREE, Chain
from app.designs.calculation.extremes import greatest_at
from app.designs.flexible_rod.cycle_pictures import request_of
from app.designs.flexible_rod.request import CheckRequest
from app.designs.units import MEGA, MILLI
from solvers.effects import EffectSelection
from solvers.rod.cycle.composition import Cycle
from solvers.rod.effects import EFFECTS, choose_for, compose
from solvers.rod.strip.buckling import critical_phase

PAPER = "T. A. Obolenskaya, A. S. Klochko: crank-slider mechanism with a flexible rod (2014)"
BEAM = "S. P. Timoshenko, J. M. Gere: Theory of Elastic Stability, beam-columns"
SECTION = "S. P. Timoshenko: Strength of Materials, bending with axial force"
MOTION = "C. F. Taylor: The Internal-Combustion Engine in Theory and Practice II, crank mechanism"
GUIDE = "close-fitting skirt: linear load along, cosine around; docs/theory/flexible-rod.md"
FATIGUE = {
    "serensen": "S. V. Serensen, R. M. Shneiderovich, V. P. Kogaev: strength of machine parts",
    "goodman": "J. E. Shigley: Mechanical Engineering Design, Goodman's line",
    "gerber": "J. E. Shigley: Mechanical Engineering Design, Gerber's parabola",
    "soderberg": "J. E. Shigley: Mechanical Engineering Design, Soderberg's line",
    "fkm": "FKM guideline: Analytical Strength Assessment, mean stress factor",
}
FOLLOWED = ("reciprocating_inertia", "beam_column", "friction")
"""Effects covered by the calculation."""
_TURN = 2.0 * math.pi
_NEGLIGIBLE_ARGUMENT = 1e-3
"""Below this K l, bending by the axial force is beyond six digits."""


def calculation(run: Mapping[str, Any], chain: Chain) -> None:
    """Add the calculation of a run with a result. Raises NotANumber."""
    _Rod(run, chain)


@dataclass(frozen=True)
class _Instant:
    """An instant of an extreme value; its name is the subscript of all symbols."""

    below: str
    angle: float
    what: str


class _Rod:
    def __init__(self, run: Mapping[str, Any], chain: Chain) -> None:
        self.request: CheckRequest = request_of(dict(run))
        self.result: Mapping[str, Any] = run["result"]
        self.active = {e["name"] for e in run["effects"] if e["state"] == "active"}
        self.inertia = "reciprocating_inertia" in self.active and self.request.piston.reciprocating_mass_kg > 0.0
        self.coupled = "beam_column" in self.active
        self.chain = chain
        self.bent: dict[str, float] = {}
        self._begin()
        self._axial()
        self._stability()
        if self.result["stress_amplitude_mpa"] is None:
            self.chain.remark("The strip buckles: stresses have no meaning beyond that, so the calculation ends here.")
            return
        self._strength()
        self._guide()

    def _cycle(self) -> Cycle:
        """The cycle with only the calculation's physics; it determines instants, not results."""
        kept = frozenset(name for name in FOLLOWED if name in self.active)
        rest = frozenset(e.name for e in EFFECTS) - kept
        scene, strip = self.request.scene(), self.request.strip()
        return Cycle(scene, strip, compose(choose_for(scene, strip, EffectSelection(kept, rest), 1.0)))

    def _begin(self) -> None:
        c, q = self.chain, self.request
        material, size = q.material.to_solver(), self.result["dimensions"]
        c.title("What is given")
        c.given("r", "crank radius", q.mechanism.crank_radius_mm, "mm")
        c.given("L", "rod length, clamp to crank pin", q.mechanism.rod_length_mm, "mm")
        c.given("D", "piston diameter", q.piston.diameter_mm, "mm")
        for name, words in (("b", "width"), ("h", "thickness"), ("l", "free length")):
            c.given(name, words, size[f"{name}_mm"], "mm", digits=8)
        c.given("E", "elastic modulus", material.elastic_modulus / MEGA, "MPa")
        c.given("rho", "density", material.density, "kg/m³")
        c.title("Machine and strip")
        c.step("lam", "r / L", "ratio of crank and rod", source=MOTION)
        c.step("A", "pi * D**2 / 4", "piston area", "mm²")
        c.step("I", "b * h**3 / 12", "second moment of area, bending in the crank's plane", "mm⁴", SECTION)
        c.step("B", "E * I", "bending stiffness", "N·mm²", SECTION)
        c.step("m", "rho * b * h * l * 1e-6", "mass of the strip", "g", reported=self.result["mass_g"])

    # The axial force at an instant ------------------------------------------------------------------------------------

    def _axial(self) -> None:
        c, load = self.chain, self.request.load
        c.title("Axial force, tension positive: its least and its greatest value of the turn")
        if load.kind == "schmidt":
            c.given("p_min", "least pressure of the cycle", load.p_min_mpa, "MPa")
            c.given("delta", "compression parameter", load.delta)
            c.given("theta", "angle of greatest pressure", load.theta_rad, DEGREE)
        if load.back_pressure_mpa is None and load.kind == "schmidt":
            formula = "p_min * (1 + delta) / sqrt(1 - delta**2)"
            c.step("p_back", formula, "back pressure: the mean of the cycle", "MPa", PAPER)
        else:
            back = self.request.scene().load.reference_pressure() / MEGA
            words = "pressure behind the piston" + ("" if load.back_pressure_mpa is not None else ": mean of the load")
            c.given("p_back", words, back, "MPa")
        if self.inertia:
            c.given("f", "turns per second", self.request.mechanism.speed_hz, "1/s")
            c.given("m_j", "reciprocating mass", self.request.piston.reciprocating_mass_kg, "kg")
            c.step("omega", "2 * pi * f", "angular speed", "1/s")
        cycle = self._cycle()
        pushed = greatest_at(lambda a: -cycle.axial_force(a), 0.0, _TURN)
        pulled = greatest_at(cycle.axial_force, 0.0, _TURN)
        self._force(_Instant("minus", pushed, "the axial force is least"), self.result["axial_force_min_n"])
        self._force(_Instant("plus", pulled, "it is greatest"), self.result["axial_force_max_n"])

    def _force(self, at: _Instant, reported: float | None = None) -> None:
        c, n, load = self.chain, at.below, self.request.load
        c.given(f"phi_{n}", f"crank angle at which {at.what}", at.angle, DEGREE)
        if load.kind == "schmidt":
            formula = f"p_min * (1 + delta) / (1 - delta * cos(phi_{n} - theta))"
            c.step(f"p_{n}", formula, "pressure there", "MPa", PAPER)
        else:
            pressure = float(self.request.scene().load.pressure(np.array([c[f"phi_{n}"]]))[0]) / MEGA
            c.given(f"p_{n}", "pressure there, read from the load", pressure, "MPa")
        gas = f"-(p_{n} - p_back) * A"
        if not self.inertia:
            c.step(f"P_{n}", gas, "axial force", "N", PAPER, reported)
            return
        c.step(f"beta_{n}", f"asin(lam * sin(phi_{n}))", "angle of the rod", DEGREE, MOTION)
        formula = (
            f"r * omega**2 / 1000 * (cos(phi_{n}) + lam * (cos(2 * phi_{n}) + lam**2 * sin(phi_{n})**4)"
            f" / cos(beta_{n})**3)"
        )
        c.step(f"a_{n}", formula, "acceleration of the piston", "m/s²", MOTION)
        c.step(f"P_{n}", f"{gas} + m_j * a_{n}", "axial force", "N", PAPER, reported)

    def _stability(self) -> None:
        c, size = self.chain, self.result["dimensions"]
        c.title("Stability")
        ratio = min(size["l_mm"] / self.request.mechanism.rod_length_mm, 1.0)
        root = critical_phase(ratio)
        c.given("x", "first root of tan x = x / (1 + L (L − l) x² / l²)", root, digits=9)
        c.step("x_left", "tan(x)", "left side")
        c.step("x_right", "x / (1 + L * (L - l) * x**2 / l**2)", "right side")
        inertia = "h * b**3" if self.result["buckles_sideways"] else "b * h**3"
        formula = f"E * {inertia} / 12 * (x / l)**2"
        c.step("P_cr", formula, "critical force", "N", BEAM, self.result["critical_force_n"])
        if self.result["stability_safety"] is not None and c["P_minus"] < 0.0:
            reported = self.result["stability_safety"]
            c.step("n_st", "P_cr / abs(P_minus)", "stability safety", source=BEAM, reported=reported)

    # Bending at an instant --------------------------------------------------------------------------------------------

    def _bending(self, at: _Instant) -> str:
        """Bending at an instant; the name is the subscript."""
        c = self.chain
        for name, angle in self.bent.items():
            if abs(angle - at.angle) < 2e-3:
                return name
        n = at.below
        self.bent[n] = at.angle
        self._force(at)
        c.step(f"s_{n}", f"r * sin(phi_{n})", "lateral stroke of the pin", "mm", PAPER)
        if self.coupled and math.sqrt(abs(c[f"P_{n}"]) / (c["E"] * c["I"])) * c["l"] > _NEGLIGIBLE_ARGUMENT:
            self._coupled(n)
            return n
        c.step(f"d_{n}", "l**3 / 3 + L * (L - l) * l", "determinant, plain bending", "mm³", BEAM)
        c.step(f"C_{n}", f"s_{n} * L / d_{n}", "curvature at the clamp", "1/mm", BEAM)
        c.step(f"D_{n}", f"-s_{n} / d_{n}", "its change along the strip", "1/mm²", BEAM)
        return n

    def _coupled(self, n: str) -> None:
        c = self.chain
        c.step(f"k_{n}", f"sqrt(abs(P_{n}) / B)", "wave number of the strip under its force", "1/mm", BEAM)
        c.step(f"u_{n}", f"k_{n} * l", "the same over the length", source=BEAM)
        u, push = f"u_{n}", c[f"P_{n}"] < 0.0
        if push:
            words = "determinant of the boundary conditions, compression"
            d = f"l**3 * (({u} * (1 - cos({u})) - {u} + sin({u})) / {u}**3) + L * (L - l) * l * sin({u}) / {u}"
            head = f"l * sin({u}) / {u} + (L - l) * cos({u})"
            turn = f"cos({u}) - (L - l) * k_{n} * sin({u})"
        else:
            words = "determinant of the boundary conditions, tension"
            d = f"l**3 * (({u} * (cosh({u}) - 1) - sinh({u}) + {u}) / {u}**3) + L * (L - l) * l * sinh({u}) / {u}"
            head = f"l * sinh({u}) / {u} + (L - l) * cosh({u})"
            turn = f"cosh({u}) + (L - l) * k_{n} * sinh({u})"
        c.step(f"d_{n}", d, words, "mm³", BEAM)
        c.step(f"C_{n}", f"s_{n} / d_{n} * ({head})", "curvature at the clamp", "1/mm", BEAM)
        c.step(f"D_{n}", f"-s_{n} / d_{n} * ({turn})", "its change along the strip", "1/mm²", BEAM)

    def _moment(self, symbol: str, n: str, z: str) -> None:
        """Bending moment at a section, from the clamp's and, in tension, the head's."""
        c, words = self.chain, "bending moment there"
        if c[z] == 0.0:
            c.step(symbol, f"B * C_{n}", words, "N·mm", BEAM)
        elif f"k_{n}" not in c.known:
            c.step(symbol, f"B * (C_{n} + D_{n} * {z})", words, "N·mm", BEAM)
        elif c[f"P_{n}"] < 0.0:
            formula = f"B * (C_{n} * cos(k_{n} * {z}) + D_{n} / k_{n} * sin(k_{n} * {z}))"
            c.step(symbol, formula, words, "N·mm", BEAM)
        else:
            if f"H_{n}" not in c.known:
                c.step(f"H_{n}", f"s_{n} * (L - l) / d_{n}", "curvature at the head", "1/mm", BEAM)
            both = f"C_{n} * sinh(k_{n} * (l - {z})) + H_{n} * sinh(k_{n} * {z})"
            c.step(symbol, f"B / sinh(u_{n}) * ({both})", words, "N·mm", BEAM)

    # Stress and fatigue -----------------------------------------------------------------------------------------------

    def _stresses(self, cycle: Cycle, angle: ArrayLike, section: ArrayLike) -> np.ndarray:
        """Stresses [Pa] of both fibres, of shape (2, sections, angles)."""
        return cycle.at(angle).fibre_stresses(section)

    def _strength(self) -> None:
        c, cycle, r = self.chain, self._cycle(), self.result
        fibre, section = int(r["worst_fibre"]), r["worst_section_mm"]
        side = "outer fibre, +h/2" if fibre > 0 else "inner fibre, −h/2"
        c.title(f"Stress and fatigue at the section that governs ({side})")
        c.given("z", "its distance from the clamp", section, "mm", "the run", digits=8)
        layer = (1 - fibre) // 2
        high = greatest_at(lambda a: self._stresses(cycle, a, section * MILLI)[layer, 0], 0.0, _TURN)
        low = greatest_at(lambda a: -self._stresses(cycle, a, section * MILLI)[layer, 0], 0.0, _TURN)
        for n, angle, when, what in (
            ("1", high, "the stress of this fibre is greatest", "greatest stress"),
            ("2", low, "the stress of this fibre is least", "least stress"),
        ):
            at = self._bending(_Instant(n, angle, when))
            self._moment(f"M_{n}", at, "z")
            sign = "+" if fibre > 0 else "-"
            c.step(f"sigma_{n}", f"P_{at} / (b * h) {sign} 6 * M_{n} / (b * h**2)", what, "MPa", SECTION)
        c.step("sigma_a", "(sigma_1 - sigma_2) / 2", "stress amplitude", "MPa", reported=r["stress_amplitude_mpa"])
        c.step("sigma_m", "(sigma_1 + sigma_2) / 2", "mean stress", "MPa", reported=r["stress_mean_mpa"])
        if r["fatigue_safety"] is not None:
            self._fatigue()
        if r["yield_safety"] is not None:
            self._yield(cycle)

    def _fatigue(self) -> None:
        c, name, material = self.chain, self.result["fatigue_criterion"], self.request.material.to_solver()
        c.given("sigma_lim", "fatigue limit", material.fatigue_limit / MEGA, "MPa")
        c.given("K", "fatigue reduction: notch, size, surface", material.fatigue_reduction)
        reported, source = self.result["fatigue_safety"], FATIGUE[name]
        words = f"fatigue safety ({name.capitalize()})"
        if name in ("serensen", "fkm"):
            c.given("psi", "mean stress sensitivity", material.mean_stress_sensitivity)
        elif name == "soderberg":
            c.given("sigma_y", "yield strength", material.yield_strength / MEGA, "MPa")
        else:
            c.given("sigma_u", "ultimate strength", (material.ultimate_strength or math.nan) / MEGA, "MPa")
        if name == "gerber":
            c.step("g", "K * sigma_a / sigma_lim", "share of the amplitude", source=source)
            c.step("w", "max(sigma_m, 0) / sigma_u", "share of the mean", source=source)
            c.step("n_sigma", "2 / (g + sqrt(g**2 + 4 * w**2))", words, source=source, reported=reported)
            return
        if name == "fkm":
            self._fkm(words, source, reported)
            return
        formula = {
            "serensen": "sigma_lim / (K * sigma_a + psi * max(sigma_m, 0))",
            "goodman": "1 / (K * sigma_a / sigma_lim + max(sigma_m, 0) / sigma_u)",
            "soderberg": "1 / (K * sigma_a / sigma_lim + max(sigma_m, 0) / sigma_y)",
        }[name]
        c.step("n_sigma", formula, words, source=source, reported=reported)

    def _fkm(self, words: str, source: str, reported: float) -> None:
        c = self.chain
        c.step("v_1", "(K * sigma_a + psi * sigma_m) / sigma_lim", "use up to R = 0", source=source)
        part = "(1 + psi) / (1 + psi / 3)"
        formula = f"{part} * (K * sigma_a + psi / 3 * sigma_m) / sigma_lim"
        c.step("v_2", formula, "use between R = 0 and R = 1/2", source=source)
        c.step("v_3", f"(1 + psi) * {part} * K * sigma_a / sigma_lim", "use beyond", source=source)
        c.step("v_0", "K * sigma_a / sigma_lim", "use without a mean", source=source)
        c.step("n_sigma", "1 / max(v_0, min(v_1, min(v_2, v_3)))", words, source=source, reported=reported)

    def _yield(self, cycle: Cycle) -> None:
        """Maximum stress over the strip."""
        c, length = self.chain, cycle.dimensions.l
        stations = np.linspace(0.0, length, 61)
        both = np.abs(self._stresses(cycle, np.linspace(0.0, _TURN, 361), stations))
        layer, place, _ = np.unravel_index(int(np.argmax(both)), both.shape)
        fibre, section = 1 - 2 * int(layer), float(stations[place])
        angle = greatest_at(lambda a: np.abs(self._stresses(cycle, a, section)[layer, 0]), 0.0, _TURN)
        section = greatest_at(lambda z: np.abs(self._stresses(cycle, [angle], z)[layer, :, 0]), 0.0, length, 121)
        angle = greatest_at(lambda a: np.abs(self._stresses(cycle, a, section)[layer, 0]), 0.0, _TURN)
        title = "The greatest stress of all (outer fibre)" if fibre > 0 else "The greatest stress of all (inner fibre)"
        c.title(title)
        c.given("z_y", "its distance from the clamp", section / MILLI, "mm", digits=8)
        at = self._bending(_Instant("y", angle, "it is greatest"))
        self._moment("M_y", at, "z_y")
        sign = "+" if fibre > 0 else "-"
        c.step("sigma_max", f"P_{at} / (b * h) {sign} 6 * M_y / (b * h**2)", "stress", "MPa", SECTION)
        if "sigma_y" not in c.known:
            c.given("sigma_y", "yield strength", self.request.material.to_solver().yield_strength / MEGA, "MPa")
        reported = self.result["yield_safety"]
        c.step("n_y", "sigma_y / abs(sigma_max)", "yield safety", reported=reported)

    # The piston in its guide ------------------------------------------------------------------------------------------

    def _guide(self) -> None:
        c, cycle, r, piston = self.chain, self._cycle(), self.result, self.request.piston
        lever, offset = 6.0 / (piston.skirt_length_mm * MILLI), piston.clamp_offset_mm * MILLI

        def side(angle: np.ndarray) -> np.ndarray:
            return np.abs(cycle.at(angle).side_force())

        def contact(angle: np.ndarray) -> np.ndarray:
            shape = cycle.at(angle)
            return np.abs(shape.side_force()) + lever * np.abs(shape.clamp_moment() + shape.side_force() * offset)

        c.title("The piston in its guide")
        at = self._bending(_Instant("T", greatest_at(side, 0.0, _TURN), "the side force is greatest"))
        c.step("T_max", f"B * abs(D_{at})", "side force", "N", BEAM, r["side_force_max_n"])
        if r["contact_pressure_max_mpa"] is None:
            return
        at = self._bending(_Instant("q", greatest_at(contact, 0.0, _TURN), "the skirt presses most"))
        c.given("L_p", "skirt length", piston.skirt_length_mm, "mm")
        c.given("e", "clamp from mid-skirt toward the crank", piston.clamp_offset_mm, "mm")
        c.step("T_q", f"-B * D_{at}", "side force", "N", BEAM)
        c.step("M_q", f"B * C_{at} + T_q * e", "moment about the skirt's middle", "N·mm", GUIDE)
        c.step("q_max", "abs(T_q) / L_p + 6 * abs(M_q) / L_p**2", "greatest load per length", "N/mm", GUIDE)
        reported = r["contact_pressure_max_mpa"]
        c.step("p_max", "4 * q_max / (pi * D)", "greatest contact pressure", "MPa", GUIDE, reported)
