"""Hand calculation of a linkage: ratios, closure, restitution, impact speed, box, torque and pin force. N, mm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from app.designs.calculation.chain import DEGREE, Chain
from app.designs.impact_linkage.pictures import bar_of

PAPER = "paper on crank-rocker impact mechanisms with the largest coupler and the largest base"
DERIVED = "derived again from the loop equation: docs/theory/impact-linkage.md"
HULL = "hull of what the joints sweep: docs/theory/impact-linkage.md"
FOLLOWED = ("envelope",)
_CLOSURES = {
    "largest_coupler": ("lam_0 + lam_3 - 1 - lam_2", "lam_0 - 1", "lam_2 + 1", 1.0),
    "largest_rocker": ("lam_0 + lam_2 - 1 - lam_3", "lam_0 - 1", "lam_2 - 1", -1.0),
    "largest_base": ("lam_2 + lam_3 - 1 - lam_0", "lam_0 + 1", "1 - lam_2", -1.0),
}
"""Closure surplus, distance rocker pivot - crank pin at the blow, N, and σ of the transfer function."""


def calculation(run: Mapping[str, Any], chain: Chain) -> None:
    """Add the calculation of a run with a result. Raises NotANumber."""
    _Linkage(run, chain)


class _Linkage:
    def __init__(self, run: Mapping[str, Any], chain: Chain) -> None:
        self.spec, self.result = run["spec"], run["result"]
        self.chain = chain
        self.surplus, self.reach, self.turn, self.sigma = _CLOSURES[self.result["type"]]
        self._ratios()
        if self.result["u31_start"] is None:
            self.chain.remark("This linkage cannot strike: nothing more follows from its lengths.")
            return
        self._blow()
        if self.result["lengths_mm"] is not None and self.result["impact_speed_m_s"] is not None:
            self._speed()
        if self.result["box_mm"] is not None:
            self._box()
        if self.result["rotatable"]:
            self._transfer()
            self._loads()

    def _ratios(self) -> None:
        c, r = self.chain, self.result
        lengths = r["lengths_mm"]
        c.title(f"Ratios and closure: {r['type'].replace('_', ' ')}")
        if lengths is not None:
            for n, name in ((0, "base"), (1, "crank"), (2, "coupler"), (3, "rocker")):
                c.given(f"l_{n}", name, lengths[name], "mm", digits=12)
            for n in (0, 2, 3):
                reported = r["ratios"][f"lambda{n}"]
                c.step(
                    f"lam_{n}",
                    f"l_{n} / l_1",
                    f"{('base', '', 'coupler', 'rocker')[n]} over crank",
                    "",
                    PAPER,
                    reported,
                    11,
                )
        else:
            for n in (0, 2, 3):
                words = f"{('base', '', 'coupler', 'rocker')[n]} over crank"
                c.given(f"lam_{n}", words, r["ratios"][f"lambda{n}"], digits=12)
        c.step("delta", self.surplus, "surplus of the closure: 0, but for digits", "", PAPER)
        formula = "lam_0 * (lam_2 * lam_3 - lam_0)"
        c.step("M_t", formula, "not negative where the crank turns fully", "", DERIVED, digits=9)

    def _blow(self) -> None:
        c, r, asked = self.chain, self.result, self.spec["restitution"]
        c.title("The blow")
        c.step("g", "sqrt(lam_0 * lam_2 / lam_3)", "gain", source=PAPER, digits=9)
        c.step("R_k", "(g - 1) / (g + 1)", "kinematic restitution", source=PAPER, reported=r["kinematic_restitution"])
        ends = (asked["low"], asked["high"]) if isinstance(asked, dict) else (asked, asked)
        if ends[0] == ends[1]:
            c.given("R", "restitution of what is struck", ends[0])
            formula = "abs(R - R_k)"
        else:
            c.given("R_1", "restitution of what is struck, least", ends[0])
            c.given("R_2", "greatest", ends[1])
            formula = "max(abs(R_1 - R_k), abs(R_2 - R_k))"
        mismatch = r["restitution_mismatch"]
        reported = mismatch if mismatch is not None and mismatch > 1e-3 else None
        c.step("Delta_R", formula, "worst mismatch of the restitution", "", PAPER, reported)
        c.step("e", self.reach, "rocker pivot to crank pin at the blow, over crank", "", PAPER, digits=9)
        c.step("u_0", "(g - 1) / e", "u31 just after the blow", "", PAPER, r["u31_start"])
        c.step("u_1", "(g + 1) / e", "u31 just before it", "", PAPER, r["u31_end"], 8)
        if r["rocker_swing_deg"] is not None:
            reported = r["rocker_swing_deg"]
            c.step("psi", "2 * asin(min(g / lam_0, 1))", "swing of the rocker", DEGREE, DERIVED, reported)
        reported = r["transmission_angle_deg"]
        if reported is not None and r["rotatable"]:
            c.step("nu", "2 * asin(min(g / lam_2, 1))", "transmission angle in mid-cycle", DEGREE, DERIVED, reported)

    def _speed(self) -> None:
        c, r, radius = self.chain, self.result, self.spec["tool_radius_mm"]
        c.title("Speed and size")
        c.given("f", "blows per second", r["blow_frequency_hz"], "1/s")
        c.step("omega", "2 * pi * f", "speed of the crank", "1/s")
        if radius is not None:
            c.given("r_t", "tool radius", radius, "mm")
        words = "speed of the tool before the blow"
        formula = f"omega * u_1 * {'l_3' if radius is None else 'r_t'} / 1000"
        c.step("v", formula, words, "m/s", PAPER, r["impact_speed_m_s"])
        c.step("l_max", "max(l_0, l_1, l_2, l_3)", "longest link", "mm", reported=r["longest_link_mm"])

    def _box(self) -> None:
        """Extent of the swept area in two directions, from the crank's circle, the rocker's pivot and the arc of its
        end."""
        c, r = self.chain, self.result
        box, bar = r["box_mm"], bar_of(dict(r))
        c.title("The box around all that it sweeps")
        c.given("alpha", "direction of the width, from the base line", math.radians(box["angle_deg"]), DEGREE)
        c.given("q", "room around every joint", self.spec["limits"]["joint_radius_mm"] or 0.0, "mm")
        _, joint = bar.joints(np.linspace(0.0, 2.0 * np.pi, 20001))
        arm = np.arctan2(joint[1], joint[0] - bar.ratios.base)
        for n, turned, words in (("w", "alpha", "width"), ("h", "alpha + pi / 2", "height")):
            direction = c["alpha"] + (0.0 if n == "w" else 0.5 * math.pi)
            reached = np.cos(arm - direction)
            c.given(
                f"theta_{n}",
                f"the rocker where it reaches farthest along the {words}",
                float(arm[np.argmax(reached)]),
                DEGREE,
            )
            c.given(f"eta_{n}", "and farthest the other way", float(arm[np.argmin(reached)]), DEGREE)
            pivot = f"l_0 * cos({turned})"
            c.step(f"a_{n}", pivot, f"the rocker's pivot along the {words}", "mm", HULL)
            far = f"max(l_1, a_{n}, a_{n} + l_3 * cos(theta_{n} - ({turned})))"
            near = f"min(-l_1, a_{n}, a_{n} + l_3 * cos(eta_{n} - ({turned})))"
            c.step(f"b_{n}", far, "farthest of circle, pivot and arc", "mm", HULL)
            c.step(f"c_{n}", near, "nearest of them", "mm", HULL)
            symbol = "W" if n == "w" else "H"
            c.step(symbol, f"b_{n} - c_{n} + 2 * q", words, "mm", HULL, box[words])
        c.step("A", "W * H", "area of the box", "mm²", reported=r["box_area_mm2"])

    # The transfer function and the loads ------------------------------------------------------------------------------

    def _point(self, n: str, angle: float, slope: bool) -> None:
        """u31 at a crank angle, and X of its slope; free of cancellation past mid-cycle."""
        c = self.chain
        c.given(f"phi_{n}", "crank angle from the blow", angle, DEGREE)
        c.step(f"c_{n}", f"cos(phi_{n} / 2)", "half angle", digits=9)
        c.step(f"s_{n}", f"sin(phi_{n} / 2)", "half angle", digits=9)
        cosine, sine, root = f"c_{n}", f"s_{n}", f"T_{n}"
        c.step(root, f"sqrt(k * lam_3 * {cosine}**2 + M_t * {sine}**2)", "root", "", DERIVED, digits=9)
        if c[cosine] >= 0.0:
            near, over = f"lam_3 * {cosine} + {root}", f"{root} + k * {cosine}"
        else:
            play = f"M_t * {sine}**2"
            near = f"(lam_3 * kappa * {cosine}**2 + {play}) / ({root} - lam_3 * {cosine})"
            over = f"({play} - k * kappa * {cosine}**2) / ({root} - k * {cosine})"
        c.step(f"D_{n}", near, "cosine part of the rocker's half angle", "", DERIVED, digits=9)
        c.step(f"A_{n}", over, "numerator", "", DERIVED, digits=9)
        c.step(f"b_{n}", f"(D_{n}**2 + N**2 * {sine}**2) / lam_3", "denominator", "", DERIVED, digits=9)
        reported = None
        if not slope:
            shown = [s["u31"] for s in self.result["transfer"] if abs(math.radians(s["phi_deg"]) - angle) < 1e-9]
            reported = shown[0] if shown else None
        c.step(f"u_{n}", f"N * A_{n} / ({root} * b_{n})", "u31 there", "", DERIVED, reported, 9)
        if not slope:
            return
        if self.sigma * c[cosine] > 0.0:
            sign = "+" if self.sigma > 0.0 else "-"
            c.step(f"G_{n}", f"M_t / ({root} {sign} lam_0 * {cosine})", "of the slope", "", DERIVED, digits=9)
        else:
            sign = "-" if self.sigma > 0.0 else "+"
            c.step(f"G_{n}", f"{root} {sign} lam_0 * {cosine}", "of the slope", "", DERIVED, digits=9)
        inner = f"A_{n} * G_{n}**2 / (b_{n} * {root}) - k * M_t / (2 * {root}**2)"
        formula = f"N / ({root} * b_{n}) * ({inner})"
        c.step(f"X_{n}", formula, "slope of u31 over sin φ/2", "", DERIVED, digits=9)

    def _transfer(self) -> None:
        c, shown = self.chain, self.result["transfer"]
        if not shown:
            return
        c.title("The transfer function, at one angle")
        c.step("N", self.turn, "factor of the type", "", DERIVED, digits=9)
        c.step("k", "lam_0 * lam_2", "abbreviation", digits=9)
        c.step("kappa", "k - lam_3", "abbreviation", digits=9)
        angle = min((math.radians(s["phi_deg"]) for s in shown), key=lambda a: abs(a - 0.5 * math.pi))
        self._point("t", angle, slope=False)

    def _loads(self) -> None:
        c, r = self.chain, self.result
        if r["peak_torque_nm"] is None:
            return
        c.title("Loads, from the rocker's inertia at constant crank speed")
        c.given("E", "energy of the blow", self.spec["impact_energy_j"], "J")
        self._point("m", math.radians(r["peak_torque_at_deg"]), slope=True)
        formula = "abs(2 * E * u_m * s_m * X_m / u_1**2)"
        c.step("M_max", formula, "greatest torque on the crank", "N·m", DERIVED, r["peak_torque_nm"])
        if r["pin_force_n"] is None:
            return
        self._point("f", math.radians(r["pin_force_at_deg"]), slope=True)
        formula = "1000 * E * lam_2 * abs(X_f) / (u_1**2 * l_1 * T_f)"
        c.step("F_max", formula, "greatest force along the coupler", "N", DERIVED, r["pin_force_n"])
