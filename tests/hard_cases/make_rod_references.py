"""Reference values for the hard cases of the rod: ``python -m tests.hard_cases.make_rod_references [NAME ...]``.

Reads rod_cases.json and writes rod_references.json, 30 digits a value, from ``solvers.references.rod``, which shares
nothing with the solver. Extremes are searched on graded grids and refined by Brent's method; the friction power is an
integral over pieces that end where its integrand has a corner.

Each value comes with its relative condition number: the sum of |d ln value / d ln input| over the real inputs of the
machine, with the position of the extreme fixed, whose change is a second-order effect.
"""

from __future__ import annotations

import json
import sys
from functools import cache, partial
from itertools import pairwise
from pathlib import Path

import mpmath as mp

from solvers.references.rod import BeamColumn, Machine
from solvers.references.searching import refined_maximum

HERE = Path(__file__).parent
DIGITS = 50
SHOWN = 30
STEP = mp.mpf(10) ** -20
SCALED = ("elastic_modulus", "b", "h", "l", "rod_length", "crank_radius", "diameter", "skirt_length", "pressure")


def changed(case, name):
    """The case with one input times 1 + STEP; ``pressure`` scales the whole load."""
    if name is None:
        return case
    if name == "pressure":
        return {**case, "pressure_scale": 1 + STEP}
    return {
        group: {key: mp.mpf(v) * (1 + STEP) if key == name else v for key, v in values.items()}
        if group in ("mechanism", "piston", "material", "dimensions")
        else values
        for group, values in case.items()
    }


def greatest(f, angles, nearby=None):
    """(angle, value) of the greatest value over a turn.

    ``nearby`` consists of fractions of the strip, rows of samples there, and the present fraction; then only angles are
    examined at which one of the two neighbouring rows is close to its own maximum.
    """
    n, turn = len(angles), 2 * mp.pi
    chosen = set(range(n))
    if nearby:
        shares, rows, at = nearby
        i = min(max(j for j, s in enumerate(shares) if s <= at), len(shares) - 2)
        chosen = set()
        for row in rows[i : i + 2]:
            top, spread = max(row), max(row) - min(row)
            chosen |= {j for j in range(n) if row[j] >= top - spread / 10}
        chosen |= {(j + d) % n for j in chosen for d in (-1, 1)}
    values = [f(a) if j in chosen else -mp.inf for j, a in enumerate(angles)]
    top = max(values)
    spread = top - min(v for v in values if v != -mp.inf)
    best = (angles[values.index(top)], top)
    if spread == 0:
        return best
    for i in range(n):
        if values[i] >= values[i - 1] and values[i] >= values[(i + 1) % n] and values[i] >= top - spread / 20:
            left = angles[i - 1] - (turn if i == 0 else 0)
            right = angles[(i + 1) % n] + (turn if i == n - 1 else 0)
            found = refined_maximum(f, left, angles[i], right)
            best = max(best, found, key=lambda pair: pair[1])
    return best


def turn_of_section(field, severity, layer, angles, shares, rows, share):
    """(severity, angle of the greatest, angle of the least) at one section."""
    mirrored = [[-value for value in row] for row in rows]
    high = greatest(lambda phi: field(share, phi, layer), angles, (shares, rows, share))
    low = greatest(lambda phi: -field(share, phi, layer), angles, (shares, mirrored, share))
    return severity(high[1], -low[1]), high[0], low[0]


def worst(machine, field, severity, layers, angles):
    """Over layers and sections: (value, layer, share, angle of the greatest, angle of the least)."""
    shares = sorted({mp.mpf(i) / 12 for i in range(13)} | {mp.mpf(10) ** -k for k in (2, 3)}
                    | {1 - mp.mpf(10) ** -k for k in (2, 3)})  # fmt: skip
    best = None
    for layer in layers:
        rows = [[field(s, phi, layer) for phi in angles] for s in shares]
        coarse = [severity(max(row), min(row)) for row in rows]
        top = max(coarse)
        section = cache(partial(turn_of_section, field, severity, layer, angles, shares, rows))
        for i in range(len(shares)):
            left, right = max(i - 1, 0), min(i + 1, len(shares) - 1)
            if coarse[i] < top * mp.mpf("0.97") or coarse[i] < max(coarse[left], coarse[right]):
                continue
            places = [shares[i]]
            inner = (shares[left] + shares[right]) / 2 if i in (left, right) else shares[i]
            end = i in (left, right)
            # If the function falls steeply from an end, the end is the maximum; only a flat end needs a search beside
            # it.
            if not end or section(inner)[0] > section(shares[i])[0] * (1 - mp.mpf("0.02")):
                places.append(refined_maximum(lambda s, of=section: of(s)[0], shares[left], inner, shares[right])[0])
            for place in places:
                value, at_high, at_low = section(place)
                if best is None or value > best[0]:
                    best = (value, layer, place, at_high, at_low)
    return best


def condition(case, evaluate):
    """Sum of |d ln value / d ln input|."""
    plain = evaluate(Machine(case))
    if plain == 0:
        return mp.mpf(1)
    return mp.fsum(abs(evaluate(Machine(changed(case, name))) / plain - 1) / STEP for name in SCALED)


def power(machine, angles):
    """Mean of the friction power over a turn, in pieces that end at the integrand's corners."""

    def excess(phi):
        return machine.couple(phi) - abs(machine.side_force(phi))

    ends = {mp.mpf(0), mp.pi, 2 * mp.pi}
    smooth = {2 * mp.pi * i / 72 for i in range(72)}
    ends |= {mp.pi * i / 4 for i in range(8)} | (set(angles) - smooth)
    inside = [a for a in angles if mp.sin(a) != 0]

    def moment(phi):
        return machine.clamp_moment(phi) + machine.side_force(phi) * machine.x["clamp_offset"]

    def zero(f, low, high):
        return mp.findroot(f, (low, high), solver="anderson", verify=False)

    for low, high in pairwise(inside):
        for f in (excess, machine.side_force, moment):
            if f(low) * f(high) < 0 and mp.sin(low) * mp.sin(high) > 0:
                ends.add(zero(f, low, high))
        # Around a zero of the moment only one wall is in contact, however narrow that interval is.
        if moment(low) * moment(high) < 0 < excess(low) and excess(high) > 0 and mp.sin(low) * mp.sin(high) > 0:
            middle = zero(moment, low, high)
            ends |= {zero(excess, low, middle), zero(excess, middle, high)}
    return mp.quad(machine.friction_power, sorted(ends), method="gauss-legendre") / (2 * mp.pi)


def check_case(case):
    """name -> (value, condition) of all results of a check."""
    machine = Machine(case)
    angles = machine.angles()
    out = {}
    at_low, push = greatest(lambda phi: -machine.force(phi), angles)
    at_high, pull = greatest(machine.force, angles)
    out["axial_force_min"] = (-push, condition(case, lambda m: m.force(at_low)))
    out["axial_force_max"] = (pull, condition(case, lambda m: m.force(at_high)))
    critical = machine.critical_force()
    out["critical_force"] = (critical, condition(case, lambda m: m.critical_force()))
    if push > 0:
        # The condition of the safety itself does not increase near 1.
        out["stability_safety"] = (critical / push, condition(case, lambda m: m.critical_force() / -m.force(at_low)))
        if critical <= push:
            return out
    material = machine.x

    def use(high, low):
        mean = (high + low) / 2
        return (material["fatigue_reduction"] * (high - low) / 2
                + material["mean_stress_sensitivity"] * max(mean, 0)) / material["fatigue_limit"]  # fmt: skip

    def field(share, phi, fibre):
        return machine.stress(share, phi, fibre)

    value, fibre, share, up, down = worst(machine, field, use, (1, -1), angles)
    if value > 0:
        out["fatigue_safety"] = (
            1 / value, condition(case, lambda m: use(m.stress(share, up, fibre), m.stress(share, down, fibre))),
        )  # fmt: skip
    value, fibre, share, up, down = worst(machine, field, lambda high, low: max(high, -low), (1, -1), angles)
    if value > 0:
        out["yield_safety"] = (
            material["yield_strength"] / value,
            condition(case, lambda m: max(m.stress(share, up, fibre), -m.stress(share, down, fibre))),
        )
    value, _, share, up, down = worst(
        machine, lambda s, phi, _: machine.deflection(s, phi), lambda high, low: max(high, -low), (1,), angles
    )
    out["deflection_ratio"] = (
        value / material["l"],
        condition(case, lambda m: max(m.deflection(share, up), -m.deflection(share, down)) / m.x["l"]),
    )
    for name, reading in (
        ("side_force_max", lambda m, phi: abs(m.side_force(phi))),
        ("clamp_moment_max", lambda m, phi: abs(m.clamp_moment(phi))),
        ("contact_pressure_max", lambda m, phi: m.contact_pressure(phi)),
    ):
        at, value = greatest(lambda phi, reading=reading: reading(machine, phi), angles)
        out[name] = (value, condition(case, lambda m, reading=reading, at=at: reading(m, at)))
    kappa = max(out["side_force_max"][1], out["clamp_moment_max"][1], out["contact_pressure_max"][1])
    out["friction_power"] = (power(machine, angles), kappa)
    return out


def held_case(case):
    """Results under a constant force, whose extremes are all a quarter turn from dead centre.

    Critical force and safety, and below buckling side force, clamp moment, contact pressure, fatigue and yield safety.
    """
    machine = Machine(case)
    force, critical, across = machine.force(mp.mpf(0)), machine.critical_force(), mp.pi / 2
    readings = {"critical_force": lambda m: m.critical_force()}
    if force < 0:
        readings["stability_safety"] = lambda m: m.critical_force() / -m.force(across)
    if force >= 0 or critical > -force:
        readings |= {
            "side_force_max": lambda m: abs(m.side_force(across)),
            "clamp_moment_max": lambda m: abs(m.clamp_moment(across)),
            "contact_pressure_max": lambda m: m.contact_pressure(across),
        }
        shares = sorted({mp.mpf(i) / 24 for i in range(25)} | {mp.mpf(10) ** (-mp.mpf(k) / 2) for k in range(2, 20)})
        sizes = [abs(machine.stress(s, across, 1) - machine.stress(s, across, -1)) for s in shares]
        top = sizes.index(max(sizes))
        left, right = shares[max(top - 1, 0)], shares[min(top + 1, len(shares) - 1)]

        def swing(share, m=machine):
            return abs(m.stress(share, across, 1) - m.stress(share, across, -1)) / 2

        place = refined_maximum(swing, left, (left + right) / 2 if top in (0, len(shares) - 1) else shares[top], right)[
            0
        ]
        place = max((place, left, right, shares[top]), key=swing)

        def fatigue(m):
            x, mean = m.x, m.force(across) / (m.x["b"] * m.x["h"])
            use = x["fatigue_reduction"] * swing(place, m) + x["mean_stress_sensitivity"] * max(mean, 0)
            return x["fatigue_limit"] / use

        readings |= {
            "fatigue_safety": fatigue,
            "yield_safety": lambda m: (
                m.x["yield_strength"] / (swing(place, m) + abs(m.force(across)) / (m.x["b"] * m.x["h"]))
            ),
        }
    return {name: (reading(machine), condition(case, reading)) for name, reading in readings.items()}


def friction_at(machine, phi, force):
    """F [N] of the strip under another axial force than the load's."""
    machine.bend = lambda _: BeamColumn(force / machine.stiffness, machine.x["l"], machine.x["rod_length"])
    side, couple = abs(machine.side_force(phi)), machine.couple(phi)
    wall = side if couple <= side else (couple + side**2 / couple) / 2
    return machine.x["friction_coefficient"] * 4 / mp.pi * wall


def closed_force(machine, phi):
    """The solution of P = P_0 + sign(v) F(P) that is reached from P_0.

    If friction adds to the compression, Newton's method from P_0 converges monotonically; if it reduces it, P_0 and
    slightly more than one fixed-point step bracket the solution.
    """
    plain, direction = machine.force(phi), mp.sign(mp.sin(phi))

    def excess(force):
        return force - plain - direction * friction_at(machine, phi, force)

    if direction > 0:
        between = plain, plain - mp.mpf("1.01") * excess(plain)
        return mp.findroot(excess, between, solver="anderson", tol=mp.mpf(10) ** (20 - 2 * DIGITS))
    force, step = plain, excess(plain)
    while abs(step) > abs(force) * mp.mpf(10) ** (10 - DIGITS):
        if step < 0:
            raise ValueError("friction buckles the strip")
        width = abs(force) * mp.mpf(10) ** (-DIGITS // 2)
        slope = (excess(force + width) - excess(force - width)) / (2 * width)
        step = excess(force) / slope
        force -= step
    return force


def loop_case(case):
    """The axial force with friction fed back, at one angle."""
    phi = mp.mpf(case["angle"])
    return {"axial_force": (closed_force(Machine(case["scene"]), phi), loop_condition(case["scene"], phi))}


def loop_condition(scene, phi):
    """``condition``, including the coefficient of friction."""
    coefficient = scene["piston"]["friction_coefficient"]
    slipperier = {**scene, "piston": {**scene["piston"], "friction_coefficient": mp.mpf(coefficient) * (1 + STEP)}}
    plain, other = (closed_force(Machine(s), phi) for s in (scene, slipperier))
    return condition(scene, lambda m: closed_force(m, phi)) + abs(other / plain - 1) / STEP


def kernel_case(case):
    """C, D, V''(l), and V'', V at shares of the length, per unit lateral displacement, with conditions in q, l, L."""

    def inputs(change=None):
        return [mp.mpf(case[n]) * (1 + STEP if n == change else 1) for n in ("coupling", "length", "rod_length")]

    def evaluate(change=None):
        q, l, L = inputs(change)
        v = BeamColumn(q, l, L)
        values = {"clamp_curvature": v(2, mp.mpf(0)), "clamp_shear": v(3, mp.mpf(0)), "head_curvature": v(2, l)}
        for i in (1, 2, 3, 4):
            z = mp.mpf(case["length"]) * i / 4
            share = z / mp.mpf(case["length"])
            values[f"curvature_{i}"], values[f"deflection_{i}"] = v(2, share * l), v(0, share * l)
        return values

    plain = evaluate()
    moved = [evaluate(name) for name in ("coupling", "length", "rod_length")]
    return {
        name: (value, mp.fsum(abs(m[name] / value - 1) / STEP for m in moved) if value else mp.mpf(1))
        for name, value in plain.items()
    }


def merged(base, changes):
    """The base machine with some fields changed; a load is replaced as a whole."""
    out = {group: dict(values) for group, values in base.items()}
    for path, value in changes.items():
        if path == "load":
            out["load"] = value
        else:
            group, name = path.split(".")
            out[group][name] = value
    return out


def load_cases():
    text = json.loads((HERE / "rod_cases.json").read_text())
    for case in text["checks"] + text["loops"]:
        case["scene"] = {**merged(text["base"], case["changes"]), "effects": case.get("effects", [])}
    return text


def main(names):
    path = HERE / "rod_references.json"
    known = json.loads(path.read_text()) if path.exists() else {}
    cases = load_cases()
    jobs = [(c["name"], kernel_case, c) for c in cases["kernels"]]
    jobs += [(c["name"], check_case, c["scene"]) for c in cases["checks"]]
    jobs += [(c["name"], loop_case, c) for c in cases["loops"]]
    for name, make, case in jobs:
        if names and name not in names:
            continue
        with mp.workdps(DIGITS):
            found = make(case)
            known[name] = {
                key: {"value": mp.nstr(value, SHOWN), "condition": float(mp.nstr(kappa, 6))}
                for key, (value, kappa) in found.items()
            }
        print(name, flush=True)
        others = json.loads(path.read_text()) if path.exists() else {}
        known = {**others, name: known[name]}
        path.write_text(json.dumps({n: known[n] for n, _, _ in jobs if n in known}, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
