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
    """The case with one input times 1 + STEP."""
    return case if name is None else {**case, name: mp.mpf(case[name]) * (1 + STEP)}


def evaluate(case, layout, change=None):
    """Every value of a case with one input changed; where pieces end moves with the loads it belongs to."""
    pin = Pin(changed(case, change))
    plain = layout["plain"]

    def moved(x):
        """The same share of the same part: boss, gap or rod."""
        if x <= plain.a:
            return x * pin.a / plain.a
        if x <= plain.a + plain.gap:
            return pin.a + (x - plain.a) * (pin.gap / plain.gap if plain.gap else 1)
        return pin.a + pin.gap + (x - plain.a - plain.gap) * pin.b / plain.b

    out = {}
    if layout["feasible"]:
        for share in PLACES:
            out[f"wall_{share}"] = pin.wall(moved(mp.mpf(share) * plain.L / 2))
        edges = [moved(x) for x in layout["edges"]]
        shares = [pair for low, high in pairwise(edges) for pair in gauss(low, high, ORDER)]
        out["free_mass"] = pin.free_mass(shares)
        out["constant_mass"] = pin.constant_mass(moved(layout["thickest"]))
    if layout["use"] > 0:
        out["force_limit"] = pin.P / pin.use_of_solid(moved(layout["place"]))
    out["solid_deflection"] = pin.solid_deflection()
    return out


def case_values(case):
    plain = Pin(case)
    place, use = plain.weakest()
    layout = {"plain": plain, "place": place, "use": use, "feasible": use <= 1}
    if layout["feasible"]:
        layout["edges"] = plain.pieces()
        layout["thickest"] = plain.thickest(layout["edges"])
    values = evaluate(case, layout)
    moved = [evaluate(case, layout, name) for name in INPUTS]
    return {
        name: (value, mp.fsum(abs(m[name] / value - 1) / STEP for m in moved) if value else mp.mpf(1))
        for name, value in values.items()
    }


def place_values(case, share):
    """The wall at one place and the solid pin's deflection; no wall where even the solid section is too weak."""

    def values(change=None):
        plain, pin = Pin(case), Pin(changed(case, change))
        x = mp.mpf(share) * plain.L / 2
        if x <= plain.a:
            at = x * pin.a / plain.a
        elif x <= plain.a + plain.gap:
            at = pin.a + (x - plain.a) * (pin.gap / plain.gap if plain.gap else 1)
        else:
            at = pin.a + pin.gap + (x - plain.a - plain.gap) * pin.b / plain.b
        return {"wall": pin.wall(at), "solid_deflection": pin.solid_deflection()}

    plain = values()
    if plain["wall"] is None:
        return {}
    moved = [values(name) for name in INPUTS]
    return {name: (v, mp.fsum(abs(m[name] / v - 1) for m in moved) / STEP) for name, v in plain.items()}


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
