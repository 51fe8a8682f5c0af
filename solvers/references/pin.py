"""Reference for a piston pin.

Forces are the textbook's piecewise polynomials and stresses functions of the bore ratio; wall thicknesses are roots by
bisection and secants; masses are Gauss quadratures over intervals that end where the governing demand changes and are
graded towards the weakest section; deflections follow from the unit-load method with Cowper's coefficient.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import mpmath as mp

from solvers.references.searching import Number, gauss, maximum, unwatched

Case = Mapping[str, Any]
"""SI units: those in ``INPUTS``, elastic_modulus, poisson, density, allowable_shear or None, criterion, min_wall."""

INPUTS = ("outer_diameter", "boss_length", "small_end_length", "gap", "force", "allowable_stress")
ORDER = 40
DIGITS = 34
_QUICK, _CHECKED = 12, 18


class Pin:
    """A case in the current precision."""

    def __init__(self, case: Case, watch: Callable[[], None] = unwatched) -> None:
        self.D, self.a, self.b, self.gap, self.P, self.sigma = (mp.mpf(case[name]) for name in INPUTS)
        self.watch = watch
        self.E, self.nu, self.rho = (mp.mpf(case[n]) for n in ("elastic_modulus", "poisson", "density"))
        self.tau = None if case["allowable_shear"] is None else mp.mpf(case["allowable_shear"])
        self.criterion, self.min_wall = case["criterion"], mp.mpf(case["min_wall"])
        self.L = 2 * self.a + self.b + 2 * self.gap
        self.wall = cache(self._wall)

    def forces(self, x):
        """Shear force [N] and bending moment [N m] at x from the end, up to the middle: in boss, gap and rod."""
        a, b, gap, P = self.a, self.b, self.gap, self.P
        if x <= a:
            return P * x**2 / (2 * a**2), P * x**3 / (6 * a**2)
        if x <= a + gap:
            return P / 2, P * a / 6 + P / 2 * (x - a)
        t = x - a - gap
        return P / 2 - P * t / b, P * a / 6 + P / 2 * (x - a) - P * t**2 / (2 * b)

    def demands(self, x, number=mp.mpf, root=mp.sqrt, pi=None):
        """Demands as functions of the bore ratio r: utilisation times 1 - r^4, so a solid section fails above 1."""
        return self.demands_of(*self.forces(x), number, root, pi)

    def demands_of(self, Q, M, number=mp.mpf, root=mp.sqrt, pi=None):
        """``demands`` for a given shear force and moment."""
        pi = pi or mp.pi
        Q, M = number(Q), number(M)
        Q, D, sigma, nu = abs(Q), number(self.D), number(self.sigma), number(self.nu)
        bending = 32 * M / (pi * D**3)
        inner, outer = 1 + 2 * nu, 3 + 2 * nu

        def zhuravsky(r):
            return 16 * Q * (1 + r + r * r) / (3 * pi * D**2)

        def elastic(r):
            return 4 * Q * (outer + inner * r * r) / (pi * (1 + nu) * D**2)

        law = elastic if self.criterion == "saint_venant" else zhuravsky
        if self.criterion in ("tresca_paper", "von_mises"):
            k = 4 if self.criterion == "tresca_paper" else 3
            found = [lambda r: root(bending**2 + k * law(r) ** 2) / sigma]
        else:
            found = [lambda r: bending / sigma, lambda r: 2 * law(r) / sigma]
        if self.tau is not None:
            tau = number(self.tau)
            found.append(lambda r: law(r) / tau)
        return found

    def thicknesses(self, x):
        """Wall thickness/radius required by every demand; None if the solid section is too weak."""
        approximate = self.demands(x, float, math.sqrt, math.pi)
        return [self.thickness(*pair) for pair in zip(self.demands(x), approximate, strict=True)]

    def thickness(self, demand, approximate):
        solid = demand(mp.mpf(0))
        if solid > 1:
            return None
        if solid == 0:
            return mp.mpf(0)

        def margin(w, of=demand):
            # 1 - (1-w)^4 as a product, without cancellation for thin walls
            return w * (2 - w) * (1 + (1 - w) ** 2) - of(1 - w)

        low, high = min(approximate(0.0), approximate(1.0)) / 16, 1.0
        for _ in range(200):
            middle = math.sqrt(low * high)
            if not low < middle < high:
                break
            low, high = (middle, high) if margin(middle, approximate) < 0 else (low, middle)
        x0, x1 = mp.mpf(low) * (1 - mp.mpf(10) ** -9), mp.mpf(high)
        f0, f1 = margin(x0), margin(x1)
        for _ in range(60):
            if f0 == f1 or abs(x1 - x0) <= abs(x1) * mp.mpf(10) ** -(mp.mp.dps - 5):
                break
            x0, x1, f0 = x1, x1 - f1 * (x1 - x0) / (f1 - f0), f1
            f1 = margin(x1)
        step = x1 * mp.mpf(10) ** -(mp.mp.dps - 22)
        if not margin(x1 - step) <= 0 <= margin(x1 + step):
            raise ArithmeticError("no root was bracketed")
        return x1

    def _wall(self, x):
        """Wall thickness/radius required by all demands and the minimum wall; None if the solid section is too weak."""
        self.watch()
        walls = self.thicknesses(x)
        return None if None in walls else max([2 * self.min_wall / self.D, *walls])

    def solid_utilisation(self, x):
        return max(demand(mp.mpf(0)) for demand in self.demands(x))

    def weakest(self):
        """(position, utilisation) of the weakest section of the solid pin."""
        self.watch()
        found = []
        for low, high in pairwise(self.load_edges()):
            found.append(maximum(self.solid_utilisation, [low + (high - low) * i / 40 for i in range(41)], 130))
        return max(found, key=lambda pair: pair[1])

    def intervals(self):
        """Edges of the intervals of one half: load boundaries, changes of the governing demand, graded edges at the
        weakest section."""
        edges = {mp.mpf(0), self.a, self.a + self.gap, self.L / 2}
        position, use = self.weakest()
        if use > mp.mpf("0.9"):
            for k in range(1, 14):
                edges |= {position - self.L * mp.mpf(10) ** -k / 2, position + self.L * mp.mpf(10) ** -k / 2}
            edges.add(position)
        edges = {x for x in edges if 0 <= x <= self.L / 2}
        edges |= {self.L / 2 * i / 4 for i in range(4)}
        for low, high in list(pairwise(sorted(edges))):
            grid = [low + (high - low) * i / 12 for i in range(13)]
            for left, right in pairwise(grid):
                inset = (right - left) / 100
                if self.governing_demand(left + inset) != self.governing_demand(right - inset):
                    edges.add(self.governing_change(left, right))
        return sorted(edges)

    def governing_demand(self, x):
        floor = 2 * self.min_wall / self.D
        walls = self.thicknesses(x)
        return max(range(len(walls) + 1), key=lambda i: [floor, *walls][i])

    def governing_change(self, left, right):
        """Position where the governing demand changes, by bisection."""
        first = self.governing_demand(left + (right - left) / 100)
        for _ in range(110):
            middle = (left + right) / 2
            left, right = (middle, right) if self.governing_demand(middle) == first else (left, middle)
        return (left + right) / 2

    def free_mass(self, nodes):
        """Mass [kg] of the free bore; ``nodes`` are quadrature nodes and weights over one half."""
        total = mp.mpf(0)
        for x, weight in nodes:
            w = self.wall(x)
            total += weight * w * (2 - w)
        return self.rho * mp.pi * self.D**2 / 4 * 2 * total

    def constant_mass(self, position):
        w = self.wall(position)
        return self.rho * mp.pi * self.D**2 / 4 * self.L * w * (2 - w)

    def load_edges(self):
        """Load boundaries up to the middle."""
        return sorted({mp.mpf(0), self.a, self.a + self.gap, self.L / 2})

    def deflection(self, ratio, nodes, with_shear=True):
        """Deflection of the middle relative to the bosses' edges [m]: twice int M m/(E I) + Q q/(k G A) over one half.

        ``ratio`` is the bore ratio as a function of position, k Cowper's coefficient of a tube (1966). ``nodes`` are
        quadrature nodes and weights; those inside the bosses do not contribute.
        """
        rigidity = self.E / (2 * (1 + self.nu))
        total = mp.mpf(0)
        for x, weight in nodes:
            if x <= self.a:
                continue
            Q, M = self.forces(x)
            r = ratio(x) ** 2
            inertia, area = mp.pi * self.D**4 / 64 * (1 - r * r), mp.pi * self.D**2 / 4 * (1 - r)
            total += weight * M * (x - self.a) / 2 / (self.E * inertia)
            if with_shear:
                k = 6 * (1 + self.nu) * (1 + r) ** 2 / ((7 + 6 * self.nu) * (1 + r) ** 2 + (20 + 12 * self.nu) * r)
                total += weight * Q / 2 / (k * rigidity * area)
        return 2 * total

    def solid_deflection(self):
        """Deflection of the solid pin [m], whose integrand is polynomial on two intervals."""
        edges = [self.a, self.a + self.gap, self.L / 2]
        nodes = [pair for low, high in pairwise(edges) if high > low for pair in gauss(low, high, 8)]
        return self.deflection(lambda _: mp.mpf(0), nodes)

    def thickest(self, edges):
        """Position of the thickest wall between these edges."""
        grid = sorted({low + (high - low) * i / 8 for low, high in pairwise(edges) for i in range(9)})
        return maximum(self.wall, grid, 90)[0]


Found = dict[str, tuple[Number | None, float]]
"""name -> (value in SI units, relative uncertainty)"""


def common(case: Case, watch: Callable[[], None]) -> Found:
    """Results independent of the bore: the solid pin's mass, the maximum moment, the pressures in the small end
    (uniform) and at the peak of a boss's triangle, the force that the solid pin bears (if loaded), and the mass of the
    constant bore allowed by strength and minimum wall (None if even the solid pin is too weak)."""
    with mp.workdps(DIGITS):
        pin = Pin(case, watch)
        solid = pin.rho * mp.pi * pin.D**2 / 4 * pin.L
        _, use = pin.weakest()
        constant = None
        if use <= 1:
            constant = pin.constant_mass(pin.thickest(pin.load_edges()))
        found = {
            "solid_mass": (solid, 0.0),
            "max_moment": (pin.forces(pin.L / 2)[1], 0.0),
            "constant_bore_mass": (constant, 0.0),
            "small_end_pressure": (pin.P / (pin.D * pin.b), 0.0),
            "boss_peak_pressure": (pin.P / (pin.D * pin.a), 0.0),
        }
        return {**found, "force_limit": (pin.P / use, 0.0)} if use else found


def free_bore(case: Case, with_shear: bool, watch: Callable[[], None]) -> Found:
    """Mass and deflection of the lightest bore under strength and minimum wall; empty if there is none."""
    with mp.workdps(DIGITS):
        pin = Pin(case, watch)
        if pin.weakest()[1] > 1:
            return {}
        edges = pin.intervals()
        masses, deflections = [], []
        for order in (_QUICK, _CHECKED):
            nodes = [pair for low, high in pairwise(edges) for pair in gauss(low, high, order)]
            masses.append(pin.free_mass(nodes))
            deflections.append(pin.deflection(lambda x: 1 - pin.wall(x), nodes, with_shear))
        return {"mass": _checked(masses), "deflection": _checked(deflections)}


def given_bore(case: Case, points: Sequence[tuple[float, float]], with_shear: bool, watch: Callable[[], None]) -> Found:
    """Mass and deflection of a symmetric bore, piecewise linear between (position, diameter) points from end to end."""
    with mp.workdps(DIGITS):
        pin = Pin(case, watch)
        bore = [(mp.mpf(x), mp.mpf(d)) for x, d in points]
        # frustums: outside minus bore
        holes = mp.fsum((x1 - x0) * (d0 * d0 + d0 * d1 + d1 * d1) / 3 for (x0, d0), (x1, d1) in pairwise(bore))
        mass = pin.rho * mp.pi / 4 * (pin.D**2 * pin.L - holes)
        if max(d for _, d in bore) >= pin.D:
            return {"mass": (mass, 0.0), "deflection": (None, 0.0)}
        half = [(x0, d0, x1, d1) for (x0, d0), (x1, d1) in pairwise(bore) if x1 > x0 and x0 < pin.L / 2]

        def ratio(x):
            watch()
            x0, d0, x1, d1 = next(part for part in reversed(half) if part[0] < x)
            return (d0 + (d1 - d0) * (x - x0) / (x1 - x0)) / pin.D

        edges = sorted({*pin.load_edges(), *(x for x, _ in bore if x < pin.L / 2)})
        found = []
        for order in (_QUICK, _CHECKED):
            nodes = [pair for low, high in pairwise(edges) for pair in gauss(low, high, order)]
            found.append(pin.deflection(ratio, nodes, with_shear))
        return {"mass": (mass, 0.0), "deflection": _checked(found)}


def _checked(values: list[Number]) -> tuple[Number, float]:
    """The last value and its relative difference from the previous one."""
    return values[-1], float(abs(values[-1] - values[-2]) / abs(values[-1])) if values[-1] else 0.0
