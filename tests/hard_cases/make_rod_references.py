"""Reference values for the hard cases of the rod: ``python -m tests.hard_cases.make_rod_references [NAME ...]``.

Reads rod_cases.json and writes rod_references.json, 30 digits a value. Nothing is shared with the solver: the strip is
V = A (cos Kz - 1) + B (sin Kz - Kz), or its hyperbolic or cubic counterpart, with A and B from the two conditions at
the head solved as they stand, at as many digits as they cancel and 50 more. Extremes are searched on graded grids and
climbed by Brent's method; the friction power is an integral over pieces that end where its integrand has a corner.

Each value comes with its relative condition number: the sum of |d ln value / d ln input| over the real inputs of the
machine, the place of the extreme held, which changes it to second order only.
"""

from __future__ import annotations

import json
import sys
from functools import cache, lru_cache, partial
from itertools import pairwise
from pathlib import Path

import mpmath as mp

HERE = Path(__file__).parent
DIGITS = 50
SHOWN = 30
STEP = mp.mpf(10) ** -20
SCALED = ("elastic_modulus", "b", "h", "l", "rod_length", "crank_radius", "diameter", "skirt_length", "pressure")


class Bent:
    """The strip at one load, per unit stroke: A and B from the two conditions at the head, solved as they stand."""

    def __init__(self, q, l, rod_length):
        x = mp.sqrt(abs(q)) * l
        small = -mp.log10(x) if x > 0 else 0
        self.q, self.k, e = q, mp.sqrt(abs(q)), rod_length - l
        with mp.workdps(DIGITS + 10 + int(max(small, 0) * 10 + x)):
            self.digits = mp.mp.dps
            f, g = self.families(l)
            a11, a12, a21, a22 = f[0] + e * f[1], g[0] + e * g[1], f[2] + e * f[3], g[2] + e * g[3]
            det = a11 * a22 - a12 * a21
            self.a, self.b = a22 / det, -a21 / det

    def families(self, z):
        """Both functions that obey the conditions at the clamp, each with three derivatives."""
        q, k = self.q, self.k
        if q == 0:
            return (z**2 / 2, z, mp.mpf(1), mp.mpf(0)), (z**3 / 6, z**2 / 2, z, mp.mpf(1))
        if q < 0:
            c, s = mp.cos_sin(k * z)
            return (c - 1, -k * s, -(k**2) * c, k**3 * s), (s - k * z, k * c - k, -(k**2) * s, -(k**3) * c)
        grown = mp.exp(k * z)
        c, s = (grown + 1 / grown) / 2, (grown - 1 / grown) / 2
        return (c - 1, k * s, k**2 * c, k**3 * s), (s - k * z, k * c - k, k**2 * s, k**3 * c)

    def __call__(self, order, z):
        """The derivative of V of this order at z."""
        with mp.workdps(self.digits):
            f, g = self.families(z)
            return self.a * f[order] + self.b * g[order]


def critical_coupling(l, rod_length):
    """-P_cr/EI: the first zero of the determinant of the same two conditions in compression."""
    beta = l / rod_length

    def residual(x):
        return beta**2 * (mp.sin(x) - x * mp.cos(x)) + (1 - beta) * x**2 * mp.sin(x)

    root = mp.findroot(residual, (mp.pi * (1 + mp.mpf(10) ** -30), mp.mpf("4.4934094579090642")), solver="anderson",
                       tol=mp.mpf(10) ** (-2 * DIGITS + 20), verify=False)  # fmt: skip
    return -((root / l) ** 2)


def pchip(angle, values):
    """The monotone cubic of F. N. Fritsch and J. Butland (1984), closed on itself after one turn."""
    n, turn = len(angle), 2 * mp.pi
    width = [(angle[(i + 1) % n] - angle[i]) + (turn if i == n - 1 else 0) for i in range(n)]
    rise = [(values[(i + 1) % n] - values[i]) / width[i] for i in range(n)]
    slope = []
    for i in range(n):
        before, after = rise[i - 1], rise[i]
        if before * after <= 0:
            slope.append(mp.mpf(0))
            continue
        w1, w2 = 2 * width[i] + width[i - 1], width[i] + 2 * width[i - 1]
        slope.append((w1 + w2) / (w1 / before + w2 / after))

    def value(phi):
        at = angle[0] + mp.fmod(mp.fmod(phi - angle[0], turn) + turn, turn)
        i = max(j for j in range(n) if angle[j] <= at)
        t = (at - angle[i]) / width[i]
        m0, m1 = slope[i] * width[i], slope[(i + 1) % n] * width[i]
        return ((1 + 2 * t) * (1 - t) ** 2 * values[i] + t * (1 - t) ** 2 * m0
                + t**2 * (3 - 2 * t) * values[(i + 1) % n] + t**2 * (t - 1) * m1)  # fmt: skip

    mean = mp.fsum(
        w * (values[i] + values[(i + 1) % n]) / 2 + w**2 * (slope[i] - slope[(i + 1) % n]) / 12
        for i, w in enumerate(width)
    )
    return value, mean / turn


class Machine:
    """A case in numbers of any precision; ``change`` multiplies one of its inputs by 1 + STEP."""

    def __init__(self, case, change=None):
        groups = {**case["mechanism"], **case["piston"], **case["material"], **case["dimensions"]}
        x = {name: mp.mpf(value) * (1 + STEP if name == change else 1) for name, value in groups.items()}
        self.x, self.load = x, case["load"]
        self.scale = 1 + STEP if change == "pressure" else mp.mpf(1)
        self.stiffness = x["elastic_modulus"] * x["b"] * x["h"] ** 3 / 12
        self.area = mp.pi * x["diameter"] ** 2 / 4
        self.inertia = "reciprocating_inertia" in case["effects"]
        self._pressure, self.back = self._source()
        self.bend, self.force = lru_cache(maxsize=None)(self._bend), lru_cache(maxsize=None)(self._force)
        self.stroke = lru_cache(maxsize=None)(self._stroke)

    def _source(self):
        load = self.load
        if load["kind"] == "constant":
            constant = mp.mpf(load["constant_pressure"])
            return (lambda phi: constant), mp.mpf(0)
        if load["kind"] == "table":
            return pchip([mp.mpf(a) for a in load["angle"]], [mp.mpf(p) for p in load["pressure"]])
        p_min, delta, theta = (mp.mpf(load[name]) for name in ("p_min", "delta", "theta"))
        mean = p_min * mp.sqrt((1 + delta) / (1 - delta))
        return (lambda phi: p_min * (1 + delta) / (1 - delta * mp.cos(phi - theta))), mean

    def _force(self, phi):
        value = -self.scale * (self._pressure(phi) - self.back) * self.area
        if self.inertia:
            r, L = self.x["crank_radius"], self.x["rod_length"]
            lam, omega = r / L, 2 * mp.pi * self.x["speed"]
            cos_beta = mp.sqrt(1 - lam**2 * mp.sin(phi) ** 2)
            bracket = mp.cos(phi) + lam * (mp.cos(2 * phi) + lam**2 * mp.sin(phi) ** 4) / cos_beta**3
            value += self.x["reciprocating_mass"] * r * omega**2 * bracket
        return value

    def _bend(self, phi):
        return Bent(self.force(phi) / self.stiffness, self.x["l"], self.x["rod_length"])

    def _stroke(self, phi):
        return self.x["crank_radius"] * mp.sin(phi)

    def stress(self, share, phi, fibre):
        """At z = share l."""
        x = self.x
        bending = x["elastic_modulus"] * x["h"] / 2 * self.bend(phi)(2, share * x["l"]) * self.stroke(phi)
        return self.force(phi) / (x["b"] * x["h"]) + fibre * bending

    def deflection(self, share, phi):
        return self.bend(phi)(0, share * self.x["l"]) * self.stroke(phi)

    def side_force(self, phi):
        return -self.stiffness * self.bend(phi)(3, mp.mpf(0)) * self.stroke(phi)

    def clamp_moment(self, phi):
        return self.stiffness * self.bend(phi)(2, mp.mpf(0)) * self.stroke(phi)

    def couple(self, phi):
        """6 |M0 + T e|/Lp."""
        moment = self.clamp_moment(phi) + self.side_force(phi) * self.x["clamp_offset"]
        return 6 * abs(moment) / self.x["skirt_length"]

    def contact_pressure(self, phi):
        whole = abs(self.side_force(phi)) + self.couple(phi)
        return 4 * whole / (mp.pi * self.x["diameter"] * self.x["skirt_length"])

    def friction_power(self, phi):
        x = self.x
        side, couple = abs(self.side_force(phi)), self.couple(phi)
        wall = side if couple <= side else (couple + side**2 / couple) / 2
        lam, omega = x["crank_radius"] / x["rod_length"], 2 * mp.pi * x["speed"]
        sine, cosine = mp.sin(phi), mp.cos(phi)
        speed = x["crank_radius"] * omega * sine * (1 + lam * cosine / mp.sqrt(1 - lam**2 * sine**2))
        return x["friction_coefficient"] * 4 / mp.pi * wall * abs(speed)

    def critical_force(self):
        x = self.x
        inertia = x["b"] * x["h"] * min(x["b"], x["h"]) ** 2 / 12
        return -x["elastic_modulus"] * inertia * critical_coupling(x["l"], x["rod_length"])

    def angles(self):
        """Sorted angles of one turn: even ones, and a graded crowd around whatever is sharp."""
        out = {2 * mp.pi * i / 72 for i in range(72)}
        if self.load["kind"] == "table":
            out |= {mp.mpf(a) % (2 * mp.pi) for a in self.load["angle"]}
        centres = [mp.mpf(self.load["theta"])] if self.load["kind"] == "schmidt" and self.load["delta"] > 0.9 else []
        if self.x["crank_radius"] > mp.mpf("0.9") * self.x["rod_length"]:
            centres += [mp.pi / 2, 3 * mp.pi / 2]
        for centre in centres:
            out |= {(centre + s * mp.mpf(10) ** (-mp.mpf(k) / 3)) % (2 * mp.pi) for k in range(1, 24) for s in (-1, 1)}
            out.add(centre % (2 * mp.pi))
        return sorted(out)


def brent(f, a, m, b, tolerance):
    """Greatest value of f in (a, b) from an inside point m: golden sections and parabolas (R. P. Brent, 1973)."""
    golden = (3 - mp.sqrt(5)) / 2
    x = w = v = m
    fx = fw = fv = f(m)
    step = before = mp.mpf(0)
    for _ in range(400):
        middle = (a + b) / 2
        if abs(x - middle) <= 2 * tolerance - (b - a) / 2:
            break
        parabolic = False
        if abs(before) > tolerance:
            r, q = (x - w) * (fx - fv), (x - v) * (fx - fw)
            p = (x - v) * q - (x - w) * r
            q = 2 * (q - r)
            p, q = (-p, q) if q > 0 else (p, -q)
            if abs(p) < abs(q * before / 2) and q * (a - x) < p < q * (b - x):
                before, step, parabolic = step, p / q, True
        if not parabolic:
            before = (a if x >= middle else b) - x
            step = golden * before
        u = x + (step if abs(step) >= tolerance else tolerance * (1 if step > 0 else -1))
        fu = f(u)
        if fu >= fx:
            a, b = (x, b) if u >= x else (a, x)
            v, fv, w, fw, x, fx = w, fw, x, fx, u, fu
        else:
            a, b = (u, b) if u < x else (a, u)
            if fu >= fw or w == x:
                v, fv, w, fw = w, fw, u, fu
            elif fu >= fv or v in (x, w):
                v, fv = u, fu
    return x, fx


def climb(f, a, m, b):
    """(place, value); a corner, where the value moves with the place itself, is narrowed twice as far."""
    width = b - a
    x, fx = brent(f, a, m, b, width * mp.mpf(10) ** -17)
    near = width * mp.mpf(10) ** -15
    fall = max(fx - f(max(x - near, a)), fx - f(min(x + near, b)))
    if abs(fall) > mp.mpf(10) ** -25 * abs(fx):
        x, fx = brent(f, max(x - 4 * near, a), x, min(x + 4 * near, b), width * mp.mpf(10) ** -34)
    return x, fx


def greatest(f, angles, nearby=None):
    """(angle, value) of the greatest value over a turn.

    ``nearby`` are shares of the strip, rows of samples there, and the share at hand: then only angles at which one of
    the two neighbouring rows comes near its own top are looked at.
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
            found = climb(f, left, angles[i], right)
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
            # An end that falls away steeply is the summit; only a flat one is worth a climb beside it.
            if not end or section(inner)[0] > section(shares[i])[0] * (1 - mp.mpf("0.02")):
                places.append(climb(lambda s, of=section: of(s)[0], shares[left], inner, shares[right])[0])
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
    return mp.fsum(abs(evaluate(Machine(case, name)) / plain - 1) / STEP for name in SCALED)


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
        # One wall carries around a zero of the moment, however narrow that stretch is.
        if moment(low) * moment(high) < 0 < excess(low) and excess(high) > 0 and mp.sin(low) * mp.sin(high) > 0:
            middle = zero(moment, low, high)
            ends |= {zero(excess, low, middle), zero(excess, middle, high)}
    return mp.quad(machine.friction_power, sorted(ends), method="gauss-legendre") / (2 * mp.pi)


def check_case(case):
    """name -> (value, condition) of everything a check answers."""
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
        # The safety itself is no worse for standing near 1.
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
    """What can be told at once of a constant force, whose extremes are all a quarter turn from dead centre.

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

        place = climb(swing, left, (left + right) / 2 if top in (0, len(shares) - 1) else shares[top], right)[0]
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


def kernel_case(case):
    """C, D, V''(l), and V'', V at shares of the length, per unit stroke, each with its condition in q, l and L."""

    def inputs(change=None):
        return [mp.mpf(case[n]) * (1 + STEP if n == change else 1) for n in ("coupling", "length", "rod_length")]

    def evaluate(change=None):
        q, l, L = inputs(change)
        v = Bent(q, l, L)
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
    """The base machine with some fields changed; a load is replaced whole."""
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
    for case in text["checks"]:
        case["scene"] = {**merged(text["base"], case["changes"]), "effects": case.get("effects", [])}
    return text


def main(names):
    path = HERE / "rod_references.json"
    known = json.loads(path.read_text()) if path.exists() else {}
    cases = load_cases()
    jobs = [(c["name"], kernel_case, c) for c in cases["kernels"]]
    jobs += [(c["name"], check_case, c["scene"]) for c in cases["checks"]]
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
