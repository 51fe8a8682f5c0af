"""Reference values for the hard cases of the pin: ``python -m tests.hard_cases.make_pin_references [NAME ...]``.

Reads pin_cases.json and writes pin_references.json. Nothing is shared with the solver: forces in the textbook's pieces,
the criteria's plain stresses in bore ratios, roots by bisection and secants at 50 digits, masses by Gauss's rule on
pieces that end wherever one demand takes over from another and crowd around the weakest section.

Each value comes with its relative condition number: the sum of |d ln value / d ln input| over the inputs.
"""

from __future__ import annotations

import json
import math
import sys
from functools import cache, lru_cache
from itertools import pairwise
from pathlib import Path

import mpmath as mp

HERE = Path(__file__).parent
DIGITS = 50
SHOWN = 30
STEP = mp.mpf(10) ** -20
INPUTS = ("outer_diameter", "boss_length", "small_end_length", "gap", "force", "allowable_stress")
PLACES = ("0.001", "0.2", "0.5", "0.9", "1")
ORDER = 40


class Pin:
    """A case in numbers of any precision; ``change`` multiplies one of its inputs by 1 + STEP."""

    def __init__(self, case, change=None):
        x = {name: mp.mpf(case[name]) * (1 + STEP if name == change else 1) for name in INPUTS}
        self.D, self.a, self.b, self.gap, self.P, self.sigma = (x[name] for name in INPUTS)
        self.E, self.nu, self.rho = (mp.mpf(case[n]) for n in ("elastic_modulus", "poisson", "density"))
        self.tau = None if case["allowable_shear"] is None else mp.mpf(case["allowable_shear"])
        self.criterion, self.min_wall = case["criterion"], mp.mpf(case["min_wall"])
        self.L = 2 * self.a + self.b + 2 * self.gap
        self.wall = lru_cache(maxsize=None)(self._wall)

    def forces(self, x):
        """Shear force and moment up to the middle, boss, gap and rod in turn."""
        a, b, gap, P = self.a, self.b, self.gap, self.P
        if x <= a:
            return P * x**2 / (2 * a**2), P * x**3 / (6 * a**2)
        if x <= a + gap:
            return P / 2, P * a / 6 + P / 2 * (x - a)
        t = x - a - gap
        return P / 2 - P * t / b, P * a / 6 + P / 2 * (x - a) - P * t**2 / (2 * b)

    def demands(self, x, number=mp.mpf, root=mp.sqrt, pi=None):
        """Functions of the bore ratio, above 1 where the section is too weak, each times 1 - ratio^4."""
        return self.demands_of(*self.forces(x), number, root, pi)

    def demands_of(self, Q, M, number=mp.mpf, root=mp.sqrt, pi=None):
        """The same for a shear force and a moment."""
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
        """The relative wall of every demand: bisection in floats, secants in digits; None beyond the solid."""
        rough = self.demands(x, float, math.sqrt, math.pi)
        return [self.thickness(*pair) for pair in zip(self.demands(x), rough, strict=True)]

    def thickness(self, demand, rough):
        full = demand(mp.mpf(0))
        if full > 1:
            return None
        if full == 0:
            return mp.mpf(0)

        def short(w, of=demand):
            # 1 - (1-w)^4, as a product that keeps thin walls' digits.
            return w * (2 - w) * (1 + (1 - w) ** 2) - of(1 - w)

        low, high = min(rough(0.0), rough(1.0)) / 16, 1.0
        for _ in range(200):
            middle = math.sqrt(low * high)
            if not low < middle < high:
                break
            low, high = (middle, high) if short(middle, rough) < 0 else (low, middle)
        x0, x1 = mp.mpf(low) * (1 - mp.mpf(10) ** -9), mp.mpf(high)
        f0, f1 = short(x0), short(x1)
        for _ in range(60):
            if f0 == f1 or abs(x1 - x0) <= abs(x1) * mp.mpf(10) ** -(DIGITS + 5):
                break
            x0, x1, f0 = x1, x1 - f1 * (x1 - x0) / (f1 - f0), f1
            f1 = short(x1)
        near = x1 * mp.mpf(10) ** -(DIGITS - 12)
        assert short(x1 - near) <= 0 <= short(x1 + near), "no root was closed in on"
        return x1

    def _wall(self, x):
        """The relative wall that every demand and the least wall ask for; None where even the solid is too weak."""
        walls = self.thicknesses(x)
        return None if None in walls else max([2 * self.min_wall / self.D, *walls])

    def use_of_solid(self, x):
        return max(demand(mp.mpf(0)) for demand in self.demands(x))

    def weakest(self):
        """(place, use) of the solid pin's worst section: golden sections on every piece."""
        best = (mp.mpf(0), self.use_of_solid(mp.mpf(0)))
        edges = sorted({mp.mpf(0), self.a, self.a + self.gap, self.L / 2})
        golden = (mp.sqrt(5) - 1) / 2
        for low, high in pairwise(edges):
            grid = [low + (high - low) * i / 40 for i in range(41)]
            top = max(range(41), key=lambda i: self.use_of_solid(grid[i]))
            left, right = grid[max(top - 1, 0)], grid[min(top + 1, 40)]
            for _ in range(130):
                p, q = right - golden * (right - left), left + golden * (right - left)
                if self.use_of_solid(p) >= self.use_of_solid(q):
                    right = q
                else:
                    left = p
            for x in (left, right, low, high):
                best = max(best, (x, self.use_of_solid(x)), key=lambda pair: pair[1])
        return best

    def pieces(self):
        """Edges of one half: loads, changes of the governing demand, a crowd around the weakest section."""
        edges = {mp.mpf(0), self.a, self.a + self.gap, self.L / 2}
        place, use = self.weakest()
        if use > mp.mpf("0.9"):
            for k in range(1, 14):
                edges |= {place - self.L * mp.mpf(10) ** -k / 2, place + self.L * mp.mpf(10) ** -k / 2}
            edges.add(place)
        edges = {x for x in edges if 0 <= x <= self.L / 2}
        edges |= {self.L / 2 * i / 4 for i in range(4)}
        for low, high in list(pairwise(sorted(edges))):
            grid = [low + (high - low) * i / 12 for i in range(13)]
            for left, right in pairwise(grid):
                if self.governs(left + (right - left) / 100) != self.governs(right - (right - left) / 100):
                    edges.add(self.change(left, right))
        return sorted(edges)

    def governs(self, x):
        floor = 2 * self.min_wall / self.D
        walls = self.thicknesses(x)
        return max(range(len(walls) + 1), key=lambda i: [floor, *walls][i])

    def change(self, left, right):
        """Where one demand takes over: bisection."""
        first = self.governs(left + (right - left) / 100)
        for _ in range(110):
            middle = (left + right) / 2
            left, right = (middle, right) if self.governs(middle) == first else (left, middle)
        return (left + right) / 2

    def free_mass(self, shares):
        """Mass of the free bore; pieces as shares of the half, so that a changed input changes them alike."""
        total = mp.mpf(0)
        for x, weight in shares:
            w = self.wall(x)
            total += weight * w * (2 - w)
        return self.rho * mp.pi * self.D**2 / 4 * 2 * total

    def constant_mass(self, place):
        w = self.wall(place)
        return self.rho * mp.pi * self.D**2 / 4 * self.L * w * (2 - w)

    def solid_deflection(self):
        """Of the middle against the bosses' edges: int M m/(E I) + Q q/(k G A), polynomials on two pieces."""
        inertia, area = mp.pi * self.D**4 / 64, mp.pi * self.D**2 / 4
        shear = self.E / (2 * (1 + self.nu))
        k = 6 * (1 + self.nu) / (7 + 6 * self.nu)
        total = mp.mpf(0)
        for low, high in ((self.a, self.a + self.gap), (self.a + self.gap, self.L / 2)):
            for x, weight in gauss(low, high):
                Q, M = self.forces(x)
                total += weight * (M * (x - self.a) / 2 / (self.E * inertia) + Q / 2 / (k * shear * area))
        return 2 * total


@cache
def nodes(order):
    """Gauss's nodes and weights on [-1, 1], by Newton's method on Legendre's polynomial."""
    out = []
    for i in range(order):
        x = mp.cos(mp.pi * (i + mp.mpf(3) / 4) / (order + mp.mpf(1) / 2))
        for _ in range(10):
            p0, p1 = mp.mpf(1), x
            for n in range(2, order + 1):
                p0, p1 = p1, ((2 * n - 1) * x * p1 - (n - 1) * p0) / n
            slope = order * (x * p1 - p0) / (x * x - 1)
            x -= p1 / slope
        out.append((x, 2 / ((1 - x * x) * slope**2)))
    return out


def gauss(low, high):
    middle, half = (low + high) / 2, (high - low) / 2
    return [(middle + half * x, half * weight) for x, weight in nodes(ORDER)]


def evaluate(case, layout, change=None):
    """Every value of a case with one input changed; where pieces end moves with the loads it belongs to."""
    pin = Pin(case, change)
    plain = layout["plain"]

    def moved(x):
        return moved_with(plain, pin, x)

    out = {}
    if layout["feasible"]:
        for share in PLACES:
            out[f"wall_{share}"] = pin.wall(moved(mp.mpf(share) * plain.L / 2))
        edges = [moved(x) for x in layout["edges"]]
        shares = [pair for low, high in pairwise(edges) for pair in gauss(low, high)]
        out["free_mass"] = pin.free_mass(shares)
        out["constant_mass"] = pin.constant_mass(moved(layout["thickest"]))
    if layout["use"] > 0:
        out["force_limit"] = pin.P / pin.use_of_solid(moved(layout["place"]))
    out["solid_deflection"] = pin.solid_deflection()
    return out


def thickest(pin, edges):
    """Where the wall is thickest: edges, and golden sections around the best of a grid."""
    grid = sorted({low + (high - low) * i / 8 for low, high in pairwise(edges) for i in range(9)})
    top = max(range(len(grid)), key=lambda i: pin.wall(grid[i]))
    left, right = grid[max(top - 1, 0)], grid[min(top + 1, len(grid) - 1)]
    golden = (mp.sqrt(5) - 1) / 2
    for _ in range(90):
        p, q = right - golden * (right - left), left + golden * (right - left)
        if pin.wall(p) >= pin.wall(q):
            right = q
        else:
            left = p
    return max([grid[top], left, right], key=pin.wall)


def case_values(case):
    plain = Pin(case)
    place, use = plain.weakest()
    layout = {"plain": plain, "place": place, "use": use, "feasible": use <= 1}
    if layout["feasible"]:
        layout["edges"] = plain.pieces()
        layout["thickest"] = thickest(plain, layout["edges"])
    values = evaluate(case, layout)
    moved = [evaluate(case, layout, name) for name in INPUTS]
    return {
        name: (value, mp.fsum(abs(m[name] / value - 1) / STEP for m in moved) if value else mp.mpf(1))
        for name, value in values.items()
    }


def tube_values(case, ratio):
    """A pin of one bore d = ratio D: mass, deflection with shear (Cowper's k of a tube) and the greatest equivalent
    stress."""

    def stress_at(pin, x, r):
        demands = pin.demands(x)[: 1 if pin.criterion in ("tresca_paper", "von_mises") else 2]
        return max(demand(r) for demand in demands) * pin.sigma / (1 - r**4)

    def worst(pin, r):
        """(part of the half, share of it)."""
        edges = [mp.mpf(0), pin.a, pin.a + pin.gap, pin.L / 2]
        golden, best = (mp.sqrt(5) - 1) / 2, (mp.mpf(-1), 0, mp.mpf(0))
        for part, (low, high) in enumerate(pairwise(edges)):
            grid = [low + (high - low) * i / 40 for i in range(41)]
            top = max(range(41), key=lambda i: stress_at(pin, grid[i], r))
            left, right = grid[max(top - 1, 0)], grid[min(top + 1, 40)]
            for _ in range(130):
                p, q = right - golden * (right - left), left + golden * (right - left)
                left, right = (left, q) if stress_at(pin, p, r) >= stress_at(pin, q, r) else (p, right)
            for x in (left, low, high):
                if high > low:
                    best = max(best, (stress_at(pin, x, r), part, (x - low) / (high - low)))
        return best[1:]

    part, share = worst(Pin(case), mp.mpf(ratio))

    def values(change=None):
        pin, bore = Pin(case, change), mp.mpf(ratio) * mp.mpf(case["outer_diameter"])
        r = bore * (1 + STEP if change == "bore" else 1) / pin.D
        edges = [mp.mpf(0), pin.a, pin.a + pin.gap, pin.L / 2]
        x = edges[part] + share * (edges[part + 1] - edges[part])
        area, inertia = mp.pi * pin.D**2 / 4 * (1 - r**2), mp.pi * pin.D**4 / 64 * (1 - r**4)
        both, more = (1 + r**2) ** 2, (20 + 12 * pin.nu) * r**2
        k = 6 * (1 + pin.nu) * both / ((7 + 6 * pin.nu) * both + more)
        modulus, total = pin.E / (2 * (1 + pin.nu)), mp.mpf(0)
        for low, high in ((pin.a, pin.a + pin.gap), (pin.a + pin.gap, pin.L / 2)):
            for place, weight in gauss(low, high):
                Q, M = pin.forces(place)
                total += weight * (M * (place - pin.a) / 2 / (pin.E * inertia) + Q / 2 / (k * modulus * area))
        return {
            "mass": pin.rho * area * pin.L,
            "deflection": 2 * total,
            "equivalent_stress_max": stress_at(pin, x, r),
        }

    return conditioned(values, (*INPUTS[:-1], "bore"))


def bushing_values(case, bore, share):
    """The least D - d at one place around a bore d, by secants on the textbook's stresses."""

    def values(change=None):
        plain, pin = Pin(case), Pin(case, change)
        Q, M = pin.forces(moved_with(plain, pin, mp.mpf(share) * plain.L / 2))
        d = mp.mpf(bore) * (1 + STEP if change == "bore" else 1)

        def excess(gap):
            pin.D = d + gap
            r = d / pin.D
            thin = gap * (2 * d + gap) * (pin.D**2 + d**2) / pin.D**4
            return mp.log(max(demand(r) for demand in pin.demands_of(Q, M)) / thin)

        low = high = pin.b
        while excess(low) < 0:
            low /= 16
        while excess(high) > 0:
            high *= 16
        for _ in range(12):
            middle = mp.sqrt(low * high)
            low, high = (middle, high) if excess(middle) > 0 else (low, middle)
        root = mp.findroot(lambda t: excess(mp.exp(t)), (mp.log(low), mp.log(high)), solver="anderson",
                           tol=mp.mpf(10) ** (-2 * DIGITS + 10), verify=False)  # fmt: skip
        return {"gap": mp.exp(root)}

    return conditioned(values, (*INPUTS[1:], "bore"))


def conditioned(values, inputs):
    """name -> (value, condition) in the named inputs."""
    plain, moved = values(), [values(name) for name in inputs]
    return {
        name: (v, mp.fsum(abs(m[name] / v - 1) for m in moved) / STEP if v else mp.mpf(1)) for name, v in plain.items()
    }


def moved_with(plain, pin, x):
    """The same share of the same part: boss, gap or rod."""
    if x <= plain.a:
        return x * pin.a / plain.a
    if x <= plain.a + plain.gap:
        return pin.a + (x - plain.a) * (pin.gap / plain.gap if plain.gap else 1)
    return pin.a + pin.gap + (x - plain.a - plain.gap) * pin.b / plain.b


def place_values(case, share):
    """The wall at one place and the solid pin's deflection; no wall where even the solid section is too weak."""

    def values(change=None):
        plain, pin = Pin(case), Pin(case, change)
        at = moved_with(plain, pin, mp.mpf(share) * (1 + STEP if change == "place" else 1) * plain.L / 2)
        return {"wall": pin.wall(at), "solid_deflection": pin.solid_deflection()}

    return conditioned(values, (*INPUTS, "place")) if values()["wall"] is not None else {}


def load_cases(group="cases"):
    text = json.loads((HERE / "pin_cases.json").read_text())
    for case in text[group]:
        case["pin"] = {**text["base"], **case["changes"]}
    return text[group]


def main(names):
    path = HERE / "pin_references.json"
    known = json.loads(path.read_text()) if path.exists() else {}
    jobs = [(case, lambda c: case_values(c["pin"])) for case in load_cases()]
    jobs += [(case, lambda c: place_values(c["pin"], c["place"])) for case in load_cases("walls")]
    jobs += [(case, lambda c: tube_values(c["pin"], c["ratio"])) for case in load_cases("tubes")]
    jobs += [(case, lambda c: bushing_values(c["pin"], c["bore"], c["place"])) for case in load_cases("bushings")]
    for case, make in jobs:
        if names and case["name"] not in names:
            continue
        with mp.workdps(DIGITS + 10):
            found = make(case)
            known[case["name"]] = {
                key: {"value": mp.nstr(value, SHOWN), "condition": float(mp.nstr(kappa, 6))}
                for key, (value, kappa) in found.items()
            }
        print(case["name"], flush=True)
        path.write_text(json.dumps(known, indent=0, sort_keys=True) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
