"""Reference values for the hard cases of the pin: ``python -m tests.hard_cases.make_pin_references [NAME ...]``.

Reads pin_cases.json and writes pin_references.json, at 50 digits, from ``solvers.references.pin``, which shares nothing
with the solver.

Each value comes with its relative condition number: the sum of |d ln value / d ln input| over the inputs.
"""

from __future__ import annotations

import json
import sys
from itertools import pairwise
from pathlib import Path

import mpmath as mp

from solvers.references.pin import INPUTS, ORDER, Pin
from solvers.references.searching import gauss

HERE = Path(__file__).parent
DIGITS = 50
SHOWN = 30
STEP = mp.mpf(10) ** -20
PLACES = ("0.001", "0.2", "0.5", "0.9", "1")


def changed(case, name):
    """The case with one input multiplied by 1 + STEP; unchanged for a name that is not an input."""
    return {**case, name: mp.mpf(case[name]) * (1 + STEP)} if name in case else case


def evaluate(case, layout, change=None):
    """Every value of a case with one input changed; the ends of pieces move with their loads."""
    pin = Pin(changed(case, change))
    plain = layout["plain"]

    def moved(x):
        return moved_with(plain, pin, x)

    out = {}
    if layout["feasible"]:
        for share in PLACES:
            out[f"wall_{share}"] = pin.wall(moved(mp.mpf(share) * plain.L / 2))
        edges = [moved(x) for x in layout["edges"]]
        shares = [pair for low, high in pairwise(edges) for pair in gauss(low, high, ORDER)]
        out["free_mass"] = pin.free_mass(shares)
        out["constant_mass"] = pin.constant_mass(moved(layout["thickest"]))
    if layout["use"] > 0:
        out["force_limit"] = pin.P / pin.solid_utilisation(moved(layout["place"]))
    out["solid_deflection"] = pin.solid_deflection()
    return out


def case_values(case):
    plain = Pin(case)
    place, use = plain.weakest()
    layout = {"plain": plain, "place": place, "use": use, "feasible": use <= 1}
    if layout["feasible"]:
        layout["edges"] = plain.intervals()
        layout["thickest"] = plain.thickest(layout["edges"])
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
        """Position of the weakest section: (part of the half, fraction of it)."""
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
        pin, bore = Pin(changed(case, change)), mp.mpf(ratio) * mp.mpf(case["outer_diameter"])
        r = bore * (1 + STEP if change == "bore" else 1) / pin.D
        edges = [mp.mpf(0), pin.a, pin.a + pin.gap, pin.L / 2]
        x = edges[part] + share * (edges[part + 1] - edges[part])
        area, inertia = mp.pi * pin.D**2 / 4 * (1 - r**2), mp.pi * pin.D**4 / 64 * (1 - r**4)
        both, more = (1 + r**2) ** 2, (20 + 12 * pin.nu) * r**2
        k = 6 * (1 + pin.nu) * both / ((7 + 6 * pin.nu) * both + more)
        modulus, total = pin.E / (2 * (1 + pin.nu)), mp.mpf(0)
        for low, high in ((pin.a, pin.a + pin.gap), (pin.a + pin.gap, pin.L / 2)):
            for place, weight in gauss(low, high, ORDER):
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
        plain, pin = Pin(case), Pin(changed(case, change))
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
    """The position at the same fraction of the same part (boss, gap or rod) in a changed pin."""
    if x <= plain.a:
        return x * pin.a / plain.a
    if x <= plain.a + plain.gap:
        return pin.a + (x - plain.a) * (pin.gap / plain.gap if plain.gap else 1)
    return pin.a + pin.gap + (x - plain.a - plain.gap) * pin.b / plain.b


def place_values(case, share):
    """The wall at one position and the solid pin's deflection; no wall if even the solid section is too weak."""

    def values(change=None):
        plain, pin = Pin(case), Pin(changed(case, change))
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
