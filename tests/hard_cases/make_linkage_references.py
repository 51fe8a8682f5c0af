"""Reference values for the linkage's hard cases: ``python -m tests.hard_cases.make_linkage_references [NAME ...]``.

Reads linkage_cases.json and writes linkage_references.json, at 240 digits, from ``solvers.references.linkage``, which
shares nothing with the solver.

Each value comes with its relative condition number: the sum of |d ln value/d ln input| over restitution and free ratio.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import mpmath as mp

from solvers.references.linkage import SIGNS, Mechanism, cycle_angles, smallest_box
from solvers.references.searching import golden_section, maximum

HERE = Path(__file__).parent
DIGITS, SHOWN = 240, 30
NEAR, STEP = mp.mpf(10) ** -40, mp.mpf(10) ** -60
MOVED = mp.mpf(10) ** -25


def inputs(case) -> tuple[mp.mpf, mp.mpf]:
    """Restitution and free ratio; a given margin is relative to the minimum ratio, rounded to the float that the solver
    gets."""
    restitution = mp.mpf(case["restitution"])
    if "parameter" in case:
        return restitution, mp.mpf(case["parameter"])
    g = (1 + restitution) / (1 - restitution)
    least = g * g if case["kind"] == "largest_rocker" else g
    found = float(least * (1 + mp.mpf(case["margin"])))
    while mp.mpf(found) < least:
        found = float(mp.mpf(found) * (1 + mp.mpf(2) ** -52))
    return restitution, mp.mpf(found)


def mechanisms(case):
    """A mechanism, and the two with a changed restitution or free ratio."""
    restitution, parameter = inputs(case)
    return Mechanism(case["kind"], restitution, parameter), [
        Mechanism(case["kind"], restitution * (1 + MOVED), parameter),
        Mechanism(case["kind"], restitution, parameter * (1 + MOVED)),
    ]


def closed_case(case, angles):
    """All values that need no search."""
    plain, moved = mechanisms(case)

    def entry(read):
        value = read(plain)
        kappa = mp.fsum(abs(read(m) / value - 1) / MOVED for m in moved)
        return {"value": mp.nstr(value, SHOWN), "condition": float(mp.nstr(kappa, 6))}

    out = {
        "parameter": {"value": mp.nstr(plain.parameter, SHOWN), "condition": 1.0},
        "lambda0": entry(lambda m: m.links[0]),
        "lambda2": entry(lambda m: m.links[1]),
        "lambda3": entry(lambda m: m.links[2]),
        "start": entry(lambda m: m.start),
        "end": entry(lambda m: m.end),
        "swing": entry(lambda m: m.swing),
        "transmission_angle": entry(lambda m: m.nu),
    }
    curve = []
    for phi in angles:
        at = mp.mpf(phi) if phi > 0 else 2 * mp.pi + mp.mpf(phi)
        u = plain.u(at)
        slope, bend = plain.slope(at), (plain.slope(at + STEP) - plain.slope(at - STEP)) / (2 * STEP)
        curve.append({
            "value": mp.nstr(u, SHOWN), "scale": mp.nstr(max(abs(u), abs(slope)), 12),
            "slope": mp.nstr(slope, SHOWN), "slope_scale": mp.nstr(max(abs(u), abs(slope), abs(bend)), 12),
        })  # fmt: skip
    return {**out, "curve": curve}


def near_case(case, torque_angle, force_angle, direction):
    """The maximum loads and the minimum box near the reported angles and direction."""
    plain, moved = mechanisms(case)
    ends = NEAR, 2 * mp.pi - NEAR
    out = {}
    for name, told in (("torque", torque_angle), ("force", force_angle)):
        # Near mid-cycle and near the blow, a peak can be as narrow as its distance from there.
        apart = min(abs(mp.mpf(told) - mp.pi), abs(2 * mp.pi - mp.mpf(told)))
        near = min(mp.mpf(10) ** -4, apart / 100 + mp.mpf(10) ** -9)
        low, high = (min(max(mp.mpf(told) + side * near, ends[0]), ends[1]) for side in (-1, 1))
        at, value = maximum(getattr(plain, name), [low, min(max(mp.mpf(told), low), high), high], 50)
        out[name] = value, [getattr(m, name)(at) for m in moved]
    with mp.workdps(45):
        near = mp.mpf(10) ** -6

        def least(m):
            return -golden_section(lambda x: -m.area(x), direction - near, direction + near, 110)[1]

        out["area"] = least(plain), [least(m) for m in moved]
        return {
            name: {
                "value": mp.nstr(value, SHOWN),
                "condition": float(mp.nstr(mp.fsum(abs(other / value - 1) for other in others) / MOVED, 6)),
            }
            for name, (value, others) in out.items()
        }


def ratio_case(case, angles):
    plain, moved = mechanisms(case)
    out = closed_case(case, angles)
    places = cycle_angles()
    for name in ("torque", "force"):
        at, value = maximum(getattr(plain, name), places, 90)
        kappa = mp.fsum(abs(getattr(m, name)(at) / value - 1) / MOVED for m in moved)
        out[name] = {"value": mp.nstr(value, SHOWN), "condition": float(mp.nstr(kappa, 6))}
    with mp.workdps(60):
        _, value = smallest_box(plain)
        kappa = mp.fsum(abs(smallest_box(m)[1] / value - 1) / MOVED for m in moved)
    out["area"] = {"value": mp.nstr(value, SHOWN), "condition": float(mp.nstr(kappa, 6))}
    return out


def length_case(case):
    """The results for given lengths; numbers with their relative condition numbers."""
    plain = [mp.mpf(text) for text in case["lengths"]]
    out = told_by_lengths(plain)
    if out["closes"]:
        base, crank, coupler, rocker = plain
        g = mp.sqrt(base * coupler / (rocker * crank))
        return out | {"condition": float(mp.nstr(4 * g / abs(g * g - 1), 6)) if g != 1 else 1.0}
    name = "blocked" if "blocked" in out else "short_stop"
    # As floats, because lengths that do not close are judged by the triangles of the floats.
    floats = [mp.mpf(float(text)) for text in case["lengths"]]
    value, kappa = mp.mpf(told_by_lengths(floats, DIGITS)[name]), mp.mpf(0)
    for i, length in enumerate(floats):
        moved = [*floats[:i], length * (1 + MOVED), *floats[i + 1 :]]
        kappa += abs(mp.mpf(told_by_lengths(moved, DIGITS)[name]) / value - 1) / MOVED
    return out | {name: mp.nstr(value, SHOWN), "condition": float(mp.nstr(kappa, 6))}


def told_by_lengths(lengths, shown=SHOWN):
    """Whether the lengths close (as decimals, to 1e-12 of the longest), and then R_k; the positions at which crank and
    rocker stop."""
    base, crank, coupler, rocker = lengths
    missed = {
        "largest_coupler": base + rocker - crank - coupler,
        "largest_rocker": base + coupler - crank - rocker,
        "largest_base": coupler + rocker - crank - base,
    }
    kind = min(missed, key=lambda name: abs(missed[name]))
    longest = max(base, crank, coupler, rocker)
    closes = abs(missed[kind]) <= longest * mp.mpf(10) ** -12
    slack = longest * mp.mpf(10) ** -12 if closes else 0
    near, far = abs(base - crank), base + crank
    turns = near >= abs(coupler - rocker) - slack and far <= coupler + rocker + slack
    out = {"kind": kind, "closes": bool(closes), "rotatable": bool(turns)}
    ties = [name for name in missed if abs(missed[name]) == abs(missed[kind])]
    if closes and len(ties) == 1:
        g = mp.sqrt(base * coupler / (rocker * crank))
        strikes = base > crank and coupler > crank if kind == "largest_rocker" else base > crank
        out["restitution"] = mp.nstr((g - 1) / (g + 1), SHOWN) if strikes or kind == "largest_base" else None
    if not closes:
        cosine = (base**2 + crank**2 - (coupler - rocker) ** 2) / (2 * base * crank)
        if kind == "largest_base":
            cosine = -(base**2 + crank**2 - (coupler + rocker) ** 2) / (2 * base * crank)
        if missed[kind] < 0:
            out["blocked"] = mp.nstr(mp.acos(cosine), shown)
        else:
            apart = coupler + crank if kind == "largest_coupler" else coupler - crank
            cosine = (base**2 + rocker**2 - apart**2) / (2 * base * rocker)
            out["short_stop"] = mp.nstr(mp.acos(-cosine if kind == "largest_coupler" else cosine), shown)
    return out


def design_case(case):
    """A limit that no type meets, with its relative condition number in restitution, frequency and speed."""
    kind, value = attained(case)
    low, high = (mp.mpf(r) for r in case["restitution"])
    _, moved = attained({**case, "restitution": [low * (1 + MOVED), high * (1 + MOVED)]})
    return {
        "requirement": "longest_link" if "longest_link" in case else "min_link",
        "kind": kind,
        "value": mp.nstr(value, SHOWN),
        "condition": float(mp.nstr(2 + abs(moved / value - 1) / MOVED, 6)),
    }


def attained(case):
    """Over the types, the least longest link or the greatest shortest link with a mid-cycle angle of 40 to 140 degrees.

    Lengths over V = v/omega and nu = 2 asin(g/lambda2) are monotone in the free ratio, so the only candidates are the
    ends of the range allowed by nu, and the ratios at which two links are equal.
    """
    low, high = (mp.mpf(value) for value in case["restitution"])
    restitution = (low + high) / 2
    scale = mp.mpf(case["speed"]) / (2 * mp.pi * mp.mpf(case["frequency"]))
    longest = "longest_link" in case
    found = {}
    for kind in SIGNS:
        g = (1 + restitution) / (1 - restitution)
        least = g * g if kind == "largest_rocker" else g
        margin = mp.mpf(10) ** -6
        if kind == "largest_rocker":
            margin = mp.mpf(10) ** -3 * (g * g - 1) / (g * g)

        def measure(p, kind=kind):
            m = Mechanism(kind, restitution, p)
            if not mp.radians(40) <= m.nu <= mp.radians(140):
                return None
            base, coupler, rocker = m.links
            crank = scale / (rocker * m.end)
            lengths = (crank, crank * base, crank * coupler, crank * rocker)
            return max(lengths) if longest else min(lengths)

        best = None
        places = [least * (1 + margin * mp.mpf(10) ** (mp.mpf(k) / 40)) for k in range(361)]
        values = [measure(p) for p in places]
        for i, value in enumerate(values):
            if value is None:
                continue
            before, after = places[max(i - 1, 0)], places[min(i + 1, 360)]

            def cost(p, measure=measure):
                told = measure(p)
                return -mp.inf if told is None else (-told if longest else told)

            _, reached = golden_section(cost, before, after, 180)
            reached = max(reached, cost(places[i]))
            best = reached if best is None else max(best, reached)
        if best is not None:
            found[kind] = -best if longest else best
    kind = (min if longest else max)(found, key=found.get)
    return kind, found[kind]


def load_cases():
    return json.loads((HERE / "linkage_cases.json").read_text())


def main(names):
    cases, path = load_cases(), HERE / "linkage_references.json"
    out = json.loads(path.read_text()) if names and path.exists() else {}
    with mp.workdps(DIGITS):
        for case in cases["ratios"]:
            if not names or case["name"] in names:
                out[case["name"]] = ratio_case(case, [*cases["angles"], *case.get("angles", ())])
                print(case["name"], flush=True)
        for case in cases["lengths"]:
            if "refused" not in case and (not names or case["name"] in names):
                out[case["name"]] = length_case(case)
    with mp.workdps(60):
        for case in cases["designs"]:
            if not names or case["name"] in names:
                out[case["name"]] = design_case(case)
                print(case["name"], flush=True)
    path.write_text(json.dumps(out, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
