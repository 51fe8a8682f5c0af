"""Hand calculation of a pin or bushing: moment, shear, governing stresses, mass, deflection, ring. N, mm, MPa."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from app.designs.calculation.chain import Chain, Column
from app.designs.pin_profile.request import CheckRequest, DesignRequest
from app.designs.units import MEGA

PAPER = "paper on optimal forms of piston pins and bushings (iteration by MathCAD), example VAZ-2112"
BEAM = "S. P. Timoshenko: Strength of Materials, beams"
ELASTIC = "S. P. Timoshenko, J. N. Goodier: Theory of Elasticity, bending of tubes"
COWPER = "G. R. Cowper: The shear coefficient in Timoshenko's beam theory (1966)"
SIMPSON = "Simpson's rule"
RING = "A. Kolchin, V. Demidov: Design of Automotive Engines, piston pin"
FOLLOWED = ("shear_deflection", "ovalization", "contact_pressure")
_FORMULA_HOLDS = 0.65
"""d/D up to which the textbook's ring formulas apply; beyond, an elastic ring correction is needed that is not done by
hand."""
_MAX_INTERVALS = 8


def calculation(run: Mapping[str, Any], chain: Chain) -> None:
    """Add the calculation of a run with a result. Raises NotANumber."""
    _Pin(run, chain)


class _Shape:
    """Diameters along the part, with one-sided values at steps."""

    def __init__(self, profile: list[Mapping[str, float]], length: float) -> None:
        self.x = np.array([p["x_mm"] for p in profile])
        self.bore = np.array([p["bore_mm"] for p in profile])
        self.outer = np.array([p["outer_diameter_mm"] for p in profile])
        self.length = length

    @property
    def whole(self) -> bool:
        """Whether the halves differ, so that integration covers the whole part."""
        there = np.linspace(0.0, 0.5 * self.length, 37)[1:-1]
        apart = [np.abs(np.interp(there, self.x, d) - np.interp(self.length - there, self.x, d)) for d in self._both]
        return bool(max(float(a.max()) for a in apart) > 1e-6 * self.outer.max())

    @property
    def _both(self) -> tuple[np.ndarray, np.ndarray]:
        return self.bore, self.outer

    def at(self, x: float, side: int = 0) -> tuple[float, float]:
        """Bore and outer diameter; ``side`` -1 and +1: just before and after a step."""
        near = x + side * 1e-7 * self.length
        return tuple(float(np.interp(near, self.x, d)) for d in self._both)

    def steps(self, end: float) -> list[float]:
        """Positions of the steps before the end."""
        jumps = (np.diff(self.x) <= 1e-9 * self.length) & (
            np.abs(np.diff(self.bore)) + np.abs(np.diff(self.outer)) > 1e-9
        )
        return [float(x) for x in self.x[:-1][jumps] if 0.0 < x < end]


class _Pin:
    def __init__(self, run: Mapping[str, Any], chain: Chain) -> None:
        model = DesignRequest if run["mode"] == "design" else CheckRequest
        self.request = model.model_validate(run["spec"])
        self.material = self.request.material.to_solver()
        self.result: Mapping[str, Any] = run["result"]
        self.active = {e["name"] for e in run["effects"] if e["state"] == "active"}
        g = self.request.geometry
        self.ends = (0.0, g.boss_length_mm, g.boss_length_mm + g.gap_mm)
        self.length = 2.0 * (g.boss_length_mm + g.gap_mm) + g.small_end_length_mm
        self.shape = _Shape(self.result["profile"], self.length)
        self.outside = self.request.seeks_outside
        self.corners = [p["x_mm"] for p in self.result.get("corners") or ()]
        if self.request.form.kind == "constant" or (run["mode"] == "check" and self.request.profile is None):
            self.corners = [0.0]
        elif run["mode"] == "check":
            self.corners = [p.x_mm for p in self.request.profile or ()]
        self.chain = chain
        self._begin()
        self._forces()
        self._sections()
        self._mass()
        self._deflection()
        self._ring()

    def _begin(self) -> None:
        c, q = self.chain, self.request
        c.title("What is given")
        c.given("P", "force", q.load.force, "N")
        c.given("a", "length in each boss", q.geometry.boss_length_mm, "mm")
        c.given("b", "length in the small end", q.geometry.small_end_length_mm, "mm")
        c.given("delta", "gap", q.geometry.gap_mm, "mm")
        if self.outside:
            c.given("d", "bore", q.bore_mm, "mm")
        else:
            c.given("D", "outer diameter", q.geometry.outer_diameter_mm, "mm")
        c.given("rho", "density", self.material.density, "kg/m³")
        c.given("sigma_adm", "allowable stress", self.material.allowable_stress / MEGA, "MPa")

    def _forces(self) -> None:
        c = self.chain
        c.title("Forces: bosses press as triangles, the small end evenly")
        c.step("L", "2 * (a + delta) + b", "length", "mm")
        c.step("c", "a + delta", "where the small end begins", "mm")
        c.step("x_m", "L / 2", "the middle", "mm")
        moment = "P * a / 6 + P * (x_m - a) / 2 - P * (x_m - c)**2 / (2 * b)"
        c.step("M_m", moment, "moment in the middle", "N·mm", PAPER, self.result["max_moment_nmm"])
        c.step("Q_max", "P / 2", "shear force in the gap, its greatest", "N", PAPER, self.result["max_shear_n"])

    def _internal(self, n: str, x: float) -> None:
        """Moment and shear force at a section, from the nearer end."""
        c, (_, boss, end) = self.chain, self.ends
        if x <= boss:
            c.step(f"M_{n}", f"P * x_{n}**3 / (6 * a**2)", "moment, in the boss", "N·mm", PAPER)
            c.step(f"Q_{n}", f"P * x_{n}**2 / (2 * a**2)", "shear force, in the boss", "N", PAPER)
        elif x <= end:
            c.step(f"M_{n}", f"P * a / 6 + P * (x_{n} - a) / 2", "moment, in the gap", "N·mm", PAPER)
            c.step(f"Q_{n}", "P / 2", "shear force, in the gap", "N", PAPER)
        else:
            formula = f"P * a / 6 + P * (x_{n} - a) / 2 - P * (x_{n} - c)**2 / (2 * b)"
            c.step(f"M_{n}", formula, "moment, in the small end", "N·mm", PAPER)
            formula = f"P / 2 - P * (x_{n} - c) / b"
            c.step(f"Q_{n}", formula, "shear force, in the small end", "N", PAPER)

    # Strength ---------------------------------------------------------------------------------------------------------

    def _sections(self) -> None:
        r, half = self.result, 0.5 * self.length
        if r["equivalent_stress_max_mpa"] is None:
            self.chain.remark("There is load where there is no wall: no stress can be told.")
            return
        worst = min(r["worst_section_mm"], self.length - r["worst_section_mm"])
        places = [("w", worst, r["worst_section_mm"], "where the stress is greatest", r["equivalent_stress_max_mpa"])]
        for n, x, words in (("m", half, "in the middle"), ("e", self.ends[1], "at the boss's inner edge")):
            if all(abs(x - other[1]) > 1e-3 * self.length for other in places):
                places.append((n, x, x, words, None))
        for n, x, from_end, words, reported in places:
            self._section(n, x, from_end, words, reported)
        c = self.chain
        if "sigma_eq_w" not in c.known:
            return
        c.step("k", "sigma_eq_w / sigma_adm", "use of the allowable stress")
        if self.material.allowable_shear is not None:
            c.given("tau_adm", "allowable shear stress", self.material.allowable_shear / MEGA, "MPa")
            c.step("k_tau", "tau_w / tau_adm", "use of the allowable shear stress, at that place")

    def _section(self, n: str, x: float, from_end: float, words: str, reported: float | None) -> None:
        c, law = self.chain, self.request.criterion
        c.title(f"Section {words}")
        bore, outer = self._diameters(n, x, from_end)
        if outer <= bore:
            c.remark("There is no wall here, and no load.")
            return
        D, d = ("D", f"d_{n}") if not self.outside else (f"D_{n}", "d")
        if f"M_{n}" not in c.known:
            self._internal(n, x)
        elif f"Q_{n}" not in c.known:
            c.step(f"Q_{n}", f"P / 2 - P * (x_{n} - c) / b", "shear force, in the small end", "N", PAPER)
        c.step(f"W_{n}", f"pi * ({D}**4 - {d}**4) / (32 * {D})", "section modulus", "mm³", BEAM)
        c.step(f"sigma_{n}", f"abs(M_{n}) / W_{n}", "bending stress, outer fibre", "MPa", BEAM)
        if law == "saint_venant":
            if "nu" not in c.known:
                c.given("nu", "Poisson's ratio", self.material.poisson)
            upper = f"4 * abs(Q_{n}) * ((3 + 2 * nu) * {D}**2 + (1 + 2 * nu) * {d}**2)"
            formula = f"{upper} / (pi * (1 + nu) * ({D}**4 - {d}**4))"
            c.step(f"tau_{n}", formula, "shear stress (Saint-Venant)", "MPa", ELASTIC)
        else:
            formula = f"16 * abs(Q_{n}) * ({D}**2 + {D} * {d} + {d}**2) / (3 * pi * ({D}**4 - {d}**4))"
            c.step(f"tau_{n}", formula, "shear stress, neutral axis (Zhuravsky)", "MPa", BEAM)
        formula, words = {
            "tresca_paper": (f"sqrt(sigma_{n}**2 + 4 * tau_{n}**2)", "equivalent stress (third theory, both maxima)"),
            "von_mises": (f"sqrt(sigma_{n}**2 + 3 * tau_{n}**2)", "equivalent stress (von Mises)"),
        }.get(law, (f"max(sigma_{n}, 2 * tau_{n})", "equivalent stress, fibre by fibre"))
        c.step(f"sigma_eq_{n}", formula, words, "MPa", PAPER, reported)

    def _diameters(self, n: str, x: float, from_end: float) -> tuple[float, float]:
        """Add the position and the varying diameter; at a step, the one with the thinner wall."""
        c = self.chain
        if n != "m":
            c.given(f"x_{n}", "its distance from the nearer end", x, "mm")
        both = min((self.shape.at(from_end, side) for side in (-1, 1)), key=lambda pair: pair[1] - pair[0])
        if self.outside:
            return c["d"], c.given(f"D_{n}", "outer diameter there", both[1], "mm")
        return c.given(f"d_{n}", "bore there", both[0], "mm"), c["D"]

    # Mass and deflection ----------------------------------------------------------------------------------------------

    def _parts(self, begin: float, end: float) -> list[tuple[float, float]]:
        """Intervals in which diameters and loads are smooth."""
        at = {begin, end, *(x for x in (*self.ends, *self.corners, *self.shape.steps(end)) if begin < x < end)}
        places = sorted(at)
        merged = [places[0]] + [b for a, b in pairwise(places) if b - a > 1e-9 * self.length]
        return list(pairwise(merged))

    def _rows(self, parts: list[tuple[float, float]], count: int) -> list[tuple[float, float]]:
        """Position and varying diameter at ``count`` points of each interval."""
        rows = []
        for begin, end in parts:
            for k, x in enumerate(np.linspace(begin, end, count)):
                side = 1 if k == 0 else -1 if k == count - 1 else 0
                rows.append((float(x), self.shape.at(float(x), side)[1 if self.outside else 0]))
        return rows

    def _mass(self) -> None:
        c, straight = self.chain, bool(self.corners)
        c.title("Mass")
        if not self.outside:
            reported = self.result["solid_mass_g"]
            c.step("m_s", "rho * pi / 4 * D**2 * L * 1e-6", "mass of the solid pin", "g", reported=reported)
        varies, words = ("D", "outer diameter") if self.outside else ("d", "bore")
        if straight and len(self.corners) == 1:
            self._diameter_all_along(varies, words)
            c.step("m", "rho * pi / 4 * (D**2 - d**2) * L * 1e-6", "mass", "g", reported=self.result["mass_g"])
            return
        whole = self.shape.whole
        parts = self._parts(0.0, self.length if whole else 0.5 * self.length)
        if len(parts) > _MAX_INTERVALS:
            c.remark("The shape has more parts than a person would add up by hand; its mass is left to the run.")
            return
        count = 3 if straight else 5
        columns = [Column("x", "place", "mm"), Column(varies, words, "mm")]
        columns.append(Column("F", "area of the section", "mm²", "pi / 4 * (D**2 - d**2)"))
        c.table(columns, self._rows(parts, count))
        terms = self._simpson("V", "F", len(parts), count, "volume of the part", "mm³")
        factor = "" if whole else "2 * "
        reported = self.result["mass_g"]
        rule = "" if straight else "; the rule is coarser than the run's"
        words = ("mass" if whole else "mass, both halves") + rule
        c.step("m", f"{factor}rho * ({terms}) * 1e-6", words, "g", reported=reported)

    def _diameter_all_along(self, symbol: str, words: str) -> None:
        if symbol not in self.chain.known:
            bore, outer = self.shape.at(0.5 * self.length)
            self.chain.given(symbol, f"{words} all along", outer if self.outside else bore, "mm")

    def _simpson(self, symbol: str, of: str, parts: int, count: int, words: str, unit: str) -> str:
        """Add a Simpson step per interval of a table; returns the sum of their symbols."""
        names = []
        for part in range(parts):
            k = part * count
            weights = "{of}_{0} + 4 * {of}_{1} + {of}_{2}" if count == 3 else (
                "{of}_{0} + 4 * {of}_{1} + 2 * {of}_{2} + 4 * {of}_{3} + {of}_{4}"
            )  # fmt: skip
            total = weights.format(*range(k, k + count), of=of)
            formula = f"(x_{k + count - 1} - x_{k}) / {6 if count == 3 else 12} * ({total})"
            self.chain.step(f"{symbol}_{part}", formula, words, unit, SIMPSON)
            names.append(f"{symbol}_{part}")
        return " + ".join(names)

    def _deflection(self) -> None:
        c, reported = self.chain, self.result["deflection_um"]
        straight = bool(self.corners)
        if reported is None or self.shape.whole:
            return
        parts = self._parts(self.ends[1], 0.5 * self.length)
        if len(parts) > _MAX_INTERVALS:
            return
        c.title("Deflection of the middle against the bosses' inner edges (unit load)")
        c.given("E", "elastic modulus", self.material.elastic_modulus / MEGA, "MPa")
        varies, words = ("D", "outer diameter") if self.outside else ("d", "bore")
        moment = "P * a / 6 + P * (x - a) / 2 - P * max(x - c, 0)**2 / (2 * b)"
        columns = [Column("x", "place", "mm"), Column(varies, words, "mm")]
        columns.append(Column("M", "moment", "N·mm", moment))
        columns.append(Column("I", "second moment of area", "mm⁴", "pi / 64 * (D**4 - d**4)"))
        bent = "M * (x - a) / (2 * E * I)"
        if "shear_deflection" in self.active:
            if "nu" not in c.known:
                c.given("nu", "Poisson's ratio", self.material.poisson)
            c.step("G", "E / (2 * (1 + nu))", "shear modulus", "MPa")
            c.step("c_1", "(7 + 6 * nu) / (6 * (1 + nu))", "Cowper's constants", source=COWPER)
            c.step("c_2", "(20 + 12 * nu) / (6 * (1 + nu))", "Cowper's constants", source=COWPER)
            columns.append(Column("Q", "shear force", "N", "P / 2 - P * max(x - c, 0) / b"))
            columns.append(Column("u", "share of the section that is solid", "", "1 - (d / D)**2"))
            shear = "(c_1 / u + c_2 * (1 - u) / (u * (2 - u)**2)) / (pi / 4 * D**2)"
            columns.append(Column("s", "shear flexibility per area", "1/mm²", shear))
            columns.append(Column("f", "turn and slide per length", "", f"{bent} + Q * s / (2 * G)"))
        else:
            columns.append(Column("f", "turn per length", "", bent))
        rows = self._rows(parts, 5)
        if min(abs(d - c["D" if not self.outside else "d"]) for _, d in rows) <= 0.0:
            c.remark("The wall runs out within the span: the deflection is left to the run.")
            return
        first = sum(1 for name in c.known if name.startswith("F_"))
        c.table(columns, rows, first)
        names = []
        for part in range(len(parts)):
            k = first + 5 * part
            total = f"f_{k} + 4 * f_{k + 1} + 2 * f_{k + 2} + 4 * f_{k + 3} + f_{k + 4}"
            formula = f"(x_{k + 4} - x_{k}) / 12 * ({total})"
            c.step(f"y_{part}", formula, "its sum over the part", "mm", SIMPSON)
            names.append(f"y_{part}")
        words = "deflection, both halves" + ("" if straight else "; the rule is coarser than the run's")
        c.step("y", f"2000 * ({' + '.join(names)})", words, "µm", reported=reported)

    # Ring and pressures -----------------------------------------------------------------------------------------------

    def _ring(self) -> None:
        c, r = self.chain, self.result
        pressures = r["contact_pressures_mpa"]
        if pressures is not None and not self.outside:
            c.title("Contact pressures")
            c.step("p_b", "P / (D * b)", "in the small end, mean", "MPa", reported=pressures["small_end"])
            c.step("p_a", "P / (2 * D * a)", "in the bosses, mean", "MPa", reported=pressures["boss_mean"])
            c.step("p_e", "P / (D * a)", "at the bosses' inner edge", "MPa", reported=pressures["boss_peak"])
        if r["ovalization_um"] is None or self.outside:
            return
        ratio = r["bore_mid_mm"] / self.request.geometry.outer_diameter_mm
        c.title("The ring in the middle")
        if ratio > _FORMULA_HOLDS:
            thin = f"The ring is thin (d/D is {ratio:.3f}, more than {_FORMULA_HOLDS})"
            said = f"{thin}: an elastic ring's series joins in there, which is left to the run."
            c.remark(said)
            return
        if "E" not in c.known:
            c.given("E", "elastic modulus", self.material.elastic_modulus / MEGA, "MPa")
        if "d" not in c.known and "d_m" not in c.known:
            c.given("d_m", "bore in the middle", r["bore_mid_mm"], "mm")
        c.step("alpha", f"{'d_m' if 'd_m' in c.known else 'd'} / D", "bore over outer diameter")
        c.step("K", "1.5 - 15 * (alpha - 0.4)**3", "how the load crowds along a stiff pin", source=RING)
        formula = "90 * P / (E * L) * ((1 + alpha) / (1 - alpha))**3 * K"
        c.step("Delta_d", formula, "ovalization", "µm", RING, r["ovalization_um"])
        c.step("f_r", "K * P / (L * D)", "load per area", "MPa", RING)
        c.step("g_r", "(1 + alpha) / (1 - alpha)**2", "factor of the wall", source=RING)
        reported = r["ring_stresses_mpa"]
        formula = "f_r * (0.19 * (2 + alpha) * g_r - 1 / (1 - alpha))"
        c.step("sigma_oa", formula, "hoop stress, outside at the side", "MPa", RING, reported["outer_side"])
        if ratio < 0.02:
            return
        formula = "-f_r * (0.19 * (1 + 2 * alpha) * g_r / alpha + 1 / (1 - alpha))"
        c.step("sigma_ia", formula, "inside at the side", "MPa", RING, reported["inner_side"])
        formula = "-f_r * (0.174 * (2 + alpha) * g_r + 0.636 / (1 - alpha))"
        c.step("sigma_ot", formula, "outside under the load", "MPa", RING, reported["outer_top"])
        formula = "f_r * (0.174 * (1 + 2 * alpha) * g_r / alpha - 0.636 / (1 - alpha))"
        c.step("sigma_it", formula, "inside under the load", "MPa", RING, reported["inner_top"])
