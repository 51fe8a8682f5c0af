"""Reference values for the hard cases of the crank: ``python -m tests.hard_cases.make_crank_references [NAME ...]``.

Reads crank_cases.json and writes crank_references.json, 30 digits a value, from ``solvers.references.crank``, which
shares nothing with the solver; a pendulum's periods come from the elliptic integral.

Each value comes with the sum of the magnitudes of its terms or, for a motion and a pendulum, with its relative
condition number: the unavoidable effect of rounding the inputs.
"""

from __future__ import annotations

import json
import sys
from itertools import pairwise
from pathlib import Path

import mpmath as mp

from solvers.references.crank import Machine, Motion

HERE = Path(__file__).parent
DIGITS = 50
MOTION_DIGITS = 700  # A position of 1e-300 is a difference of lengths.
SHOWN = 30
STEP = mp.mpf(10) ** -20
GRID = 360
TRIED = 5


def golden(function, low, high):
    """The maximum of a unimodal function between two points: half the digits of its position, all of its value."""
    ratio = (mp.sqrt(5) - 1) / 2
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    fa, fb = function(a), function(b)
    for _ in range(70):
        if fa > fb:
            high, b, fb = b, a, fa
            a = high - ratio * (high - low)
            fa = function(a)
        else:
            low, a, fa = a, b, fb
            b = low + ratio * (high - low)
            fb = function(b)
    return (low + high) / 2


def greatest(function, breaks, parts):
    """Position of the maximum, and whether it is the limit from the left at a break.

    Every piece is sampled at ``parts`` of the cycle; in the best pieces the interval around the best sample is refined.
    """
    pieces = []
    for low, high in pairwise(breaks):
        count = max(8, int(parts * (high - low) / (breaks[-1] - breaks[0])))
        grid = [low + (high - low) * k / count for k in range(count + 1)]
        values = [function(a, k == count) for k, a in enumerate(grid)]
        top = max(range(count + 1), key=values.__getitem__)
        pieces.append((values[top], grid, top))
    pieces.sort(key=lambda piece: piece[0], reverse=True)
    found = []
    for value, grid, top in pieces[:TRIED]:
        last = len(grid) - 1
        found.append((value, grid[top], top == last))
        inside = golden(lambda a: function(a, False), grid[max(top - 1, 0)], grid[min(top + 1, last)])
        found.append((function(inside, False), inside, False))
    _, place, before = max(found, key=lambda entry: entry[0])
    return place, before


def works(machine, work):
    """Mean torque and power of a cycle with this gas work, each with the sum of the magnitudes of its terms."""
    breaks, period = machine.gas.breaks, machine.gas.period
    positions = [machine.motion.position(b) for b in breaks]
    size = sum(
        max(abs(machine.gas.at(a)[0]), abs(machine.gas.at(b, True)[0])) * abs(x1 - x0) * machine.area
        for a, b, x0, x1 in zip(breaks, breaks[1:], positions, positions[1:], strict=False)
    )
    # Volumes are rounded including the clearance.
    values = [machine.gas.at(b)[0] for b in breaks]
    size += (max(values) - min(values)) * machine.x["clearance_volume"]
    size += 2 * abs(machine.x["crankcase_pressure"]) * machine.area * (machine.motion.high - machine.motion.low)
    swings = max(machine.kinetic(breaks[0] + period * k / 64) for k in range(64))
    turns = 2 * mp.pi / period
    return {
        "indicated_power": (work * machine.x["speed"] * turns, size * machine.x["speed"] * turns),
        "torque_mean": (work / period, (size + 4 * abs(swings)) / period),
    }


def cycle_values(case):
    """{name: (value, size)} for a machine's cycle."""
    machine = Machine(case)
    breaks, period = machine.gas.breaks, machine.gas.period
    found = {}
    for name in machine.forces(breaks[0]):
        if name == "torque":
            continue
        place, before = greatest(lambda a, b, name=name: machine.forces(a, b)[name][0], breaks, GRID)
        found[name] = machine.forces(place, before)[name]
    work = machine.gas.work_to(breaks[0] + period)
    told = works(machine, work)
    found |= told
    whole = told["torque_mean"][1] * period
    mean = len(machine.phases) * work / period

    def surplus(a, _):
        return sum(machine.energy(a - psi + 2 * period) for psi in machine.phases) - mean * (a + 2 * period)

    shifted = sorted({breaks[0] + mp.fmod(b + psi - breaks[0], period) for b in breaks for psi in machine.phases})
    shifted = [*shifted, breaks[0] + period] if shifted[-1] < breaks[0] + period else shifted
    high = surplus(greatest(surplus, shifted, GRID)[0], False)
    low = -surplus(greatest(lambda a, b: -surplus(a, b), shifted, GRID)[0], False)
    found["work_fluctuation"] = (high + low, len(machine.phases) * whole)
    return found


def _conditioned(values, inputs):
    """{name: (value, condition number)} of a function of named inputs, by differences at the twentieth digit."""
    plain = values(inputs)
    change = dict.fromkeys(plain, mp.mpf(0))
    for name, value in inputs.items():
        if not value:
            continue
        moved = values({**inputs, name: value * (1 + STEP)})
        for out, was in plain.items():
            change[out] += abs(moved[out] / was - 1) / STEP if was else 0
    return {name: (value, change[name]) for name, value in plain.items()}


def motion_values(case):
    """Kinematics at one angle, and the angles of one position."""
    inputs = {name: mp.mpf(value) for name, value in case["inputs"].items()}

    def values(x):
        m = Motion(x["crank_radius"], x["rod_length"], x["offset"])
        found = {}
        if "angle" in x:
            phi = x["angle"]
            beta, _, bending = m.rod_angle(phi)
            found |= {
                "displacement": m.position(phi),
                "velocity": m.velocity(phi),
                "acceleration": m.acceleration(phi),
                "rod_tangent": mp.tan(beta),
                "rod_angular_acceleration": bending,
            }
        if "position" in x:
            found["crank_angle"] = m.angle_of(x["position"])
        return found

    return _conditioned(values, inputs)


def pendulum_values(case):
    """A rod's masses from two periods, the amplitude by the elliptic integral."""
    inputs = {name: mp.mpf(value) for name, value in case["inputs"].items()}

    def values(x):
        late = 2 * mp.ellipk(mp.sin(x["amplitude"] / 2) ** 2) / mp.pi
        a, b = (x["gravity"] * (x[f"period_{end}_end"] / late) ** 2 / (4 * mp.pi**2) for end in ("small", "big"))
        pivots, mass = x["pivot_distance"], x["rod_mass"]
        arm = pivots * (b - pivots) / (a + b - 2 * pivots)
        cg = arm - x["small_end_bore_radius"]
        length = pivots - x["small_end_bore_radius"] - x["big_end_bore_radius"]
        inertia = mass * arm * (a - arm)
        return {
            "rod_cg_from_pin": cg,
            "rod_mass_at_pin": mass * (1 - cg / length),
            "rod_mass_at_crank": mass * cg / length,
            "rod_inertia": inertia,
            "inertia_defect": mass * cg * (length - cg) - inertia,
        }

    return _conditioned(values, inputs)


MAKERS = {"motions": motion_values, "cycles": cycle_values, "pendulums": pendulum_values}


def merged(base, changes):
    """The base with whole groups replaced key by key; a pressure is replaced as a whole."""
    out = {**base}
    for name, value in changes.items():
        whole = name == "pressure" or not isinstance(value, dict)
        out[name] = value if whole else {**base[name], **value}
    return out


def load_cases():
    """The cases by group, every cycle complete."""
    data = json.loads((HERE / "crank_cases.json").read_text())
    cycles = [{**case, "scene": merged(data["base"], case["changes"])} for case in data["cycles"]]
    return {"motions": data["motions"], "cycles": cycles, "pendulums": data["pendulums"]}


def main(names):
    path = HERE / "crank_references.json"
    known = json.loads(path.read_text()) if names and path.exists() else {}
    second = {"cycles": "size", "motions": "condition", "pendulums": "condition"}
    digits = {"motions": MOTION_DIGITS}
    for group, cases in load_cases().items():
        for case in cases:
            if names and case["name"] not in names:
                continue
            mp.mp.dps = digits.get(group, DIGITS)
            made = MAKERS[group](case.get("scene", case))
            known[case["name"]] = {
                name: {"value": mp.nstr(value, SHOWN), second[group]: float(mp.nstr(other, 3))}
                for name, (value, other) in made.items()
            }
            print(case["name"], flush=True)
    path.write_text(json.dumps(known, indent=0) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
