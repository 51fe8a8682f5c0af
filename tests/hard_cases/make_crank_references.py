"""Reference values for the hard cases of the crank: ``python -m tests.hard_cases.make_crank_references [NAME ...]``.

Reads crank_cases.json and writes crank_references.json, 30 digits a value. Nothing is shared with the solver: positions
come from Pythagoras, their derivatives from the calculus of the root, forces from the angle of the rod, the work of the
gas from the antiderivative of the diagram and that of the masses from their kinetic energy, periods from the elliptic
integral.

Each value comes with the sum of the magnitudes of what is added up to it, or, for a motion and a pendulum, with its
relative condition number: what a change of the inputs' last digits does to it anyway.
"""

from __future__ import annotations

import json
import sys
from bisect import bisect_right
from functools import cache
from itertools import pairwise
from pathlib import Path

import mpmath as mp

HERE = Path(__file__).parent
DIGITS = 50
MOTION_DIGITS = 700  # A position of 1e-300 is a difference of lengths.
SHOWN = 30
STEP = mp.mpf(10) ** -20
GRID = 360
TRIED = 5


class Motion:
    """x(phi) = H - r cos phi - sqrt(L^2 - (r sin phi - e)^2) and its calculus."""

    def __init__(self, r, length, e):
        self.r, self.length, self.e = r, length, e
        self.high = mp.sqrt((length + r) ** 2 - e**2)
        self.low = mp.sqrt((length - r) ** 2 - e**2)
        self.top, self.bottom = mp.asin(e / (length + r)), mp.pi + mp.asin(e / (length - r))

    def _root(self, phi):
        s = self.r * mp.sin(phi) - self.e
        return s, mp.sqrt(self.length**2 - s**2)

    def position(self, phi):
        return self.high - self.r * mp.cos(phi) - self._root(phi)[1]

    def velocity(self, phi):
        s, c = self._root(phi)
        return self.r * mp.sin(phi) + s * self.r * mp.cos(phi) / c

    def acceleration(self, phi):
        s, c = self._root(phi)
        first, second = self.r * mp.cos(phi), -self.r * mp.sin(phi)
        return self.r * mp.cos(phi) + (first**2 + s * second) / c + (s * first) ** 2 / c**3

    def rod_angle(self, phi):
        """beta and its first two derivatives."""
        s, c = self._root(phi)
        first, second = self.r * mp.cos(phi), -self.r * mp.sin(phi)
        return mp.asin(s / self.length), first / c, second / c + s * first**2 / c**3

    def angle_of(self, x):
        """The angle on the way down, from the law of cosines in the triangle r, L, d, taken in half angles."""
        height = self.high - x
        d = mp.sqrt(height**2 + self.e**2)
        r, length = self.r, self.length
        above, below = (length + r - d) * (length - r + d), (r + d - length) * (r + d + length)
        return mp.atan2(self.e, height) + 2 * mp.atan2(mp.sqrt(above), mp.sqrt(below))


def hermite_slopes(x, y, closed):
    """Slopes of the monotone cubic of F. N. Fritsch and J. Butland (1984), its ends by Moler's three points."""
    n = len(x)
    width = [x[i + 1] - x[i] for i in range(n - 1)]
    rise = [(y[i + 1] - y[i]) / width[i] for i in range(n - 1)]

    def inner(h0, h1, d0, d1):
        if d0 * d1 <= 0:
            return mp.mpf(0)
        w0, w1 = 2 * h1 + h0, h1 + 2 * h0
        return (w0 + w1) / (w0 / d0 + w1 / d1)

    def end(h0, h1, d0, d1):
        slope = ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1)
        if mp.sign(slope) != mp.sign(d0):
            return mp.mpf(0)
        return 3 * d0 if mp.sign(d0) != mp.sign(d1) and abs(slope) > 3 * abs(d0) else slope

    middle = [inner(width[i - 1], width[i], rise[i - 1], rise[i]) for i in range(1, n - 1)]
    if closed:
        edge = inner(width[-1], width[0], rise[-1], rise[0])
        return [edge, *middle, edge]
    if n == 2:
        return [rise[0], rise[0]]
    return [end(width[0], width[1], rise[0], rise[1]), *middle, end(width[-1], width[-2], rise[-1], rise[-2])]


class Cubic:
    """A piecewise cubic with its derivative and antiderivative; constant beyond its ends."""

    def __init__(self, x, y, closed=False):
        self.x, self.y, self.m = x, y, hermite_slopes(x, y, closed)
        self.area = [mp.mpf(0)]
        for i in range(len(x) - 1):
            self.area.append(self.area[-1] + self._part(i, mp.mpf(1)))

    def _part(self, i, t):
        h, y0, y1, m0, m1 = self._piece(i)
        return h * (y0 * (t - t**3 + t**4 / 2) + m0 * (t**2 / 2 - 2 * t**3 / 3 + t**4 / 4)
                    + y1 * (t**3 - t**4 / 2) + m1 * (t**4 / 4 - t**3 / 3))  # fmt: skip

    def _piece(self, i):
        h = self.x[i + 1] - self.x[i]
        return h, self.y[i], self.y[i + 1], h * self.m[i], h * self.m[i + 1]

    def at(self, x):
        """Value, slope, and the integral from the first point."""
        if x <= self.x[0]:
            return self.y[0], mp.mpf(0), self.y[0] * (x - self.x[0])
        if x >= self.x[-1]:
            return self.y[-1], mp.mpf(0), self.area[-1] + self.y[-1] * (x - self.x[-1])
        i = bisect_right(self.x, x) - 1
        h, y0, y1, m0, m1 = self._piece(i)
        t = (x - self.x[i]) / h
        value = (1 + 2 * t) * (1 - t) ** 2 * y0 + t * (1 - t) ** 2 * m0 + t**2 * (3 - 2 * t) * y1 + t**2 * (t - 1) * m1
        slope = 6 * t * (t - 1) * (y0 - y1) + (1 - t) * (1 - 3 * t) * m0 + t * (3 * t - 2) * m1
        return value, slope / h, self.area[i] + self._part(i, t)


class Gas:
    """The pressure over the angle: from a table, or from a diagram's strokes."""

    def __init__(self, case, motion, area, clearance):
        self.motion, self.area, self.clearance = motion, area, clearance
        self.period = case["cylinder"]["strokes"] * mp.pi
        pressure = case["pressure"]
        self.table = pressure["kind"] == "table"
        if self.table:
            angle, values = [mp.mpf(a) for a in pressure["angle"]], [mp.mpf(p) for p in pressure["pressure"]]
            if angle[-1] - angle[0] < self.period * (1 - mp.mpf("1e-9")):
                angle, values = [*angle, angle[0] + self.period], [*values, values[0]]
            self.start, self.curves = angle[0], [Cubic(angle, values, closed=True)]
            inside = [motion.top + mp.fmod(a - motion.top + 4 * self.period, self.period) for a in angle]
        else:
            self.curves = []
            for stroke in pressure["strokes"]:
                points = sorted(zip(stroke["volume"], stroke["pressure"], strict=True))
                self.curves.append(Cubic([mp.mpf(v) for v, _ in points], [mp.mpf(p) for _, p in points]))
            inside = [angle for index in range(len(self.curves)) for angle in self._angles(index)]
        half = [motion.top, motion.bottom]
        turns = [angle + 2 * mp.pi * k for k in range(case["cylinder"]["strokes"] // 2) for angle in half]
        breaks = sorted({*turns, *inside, motion.top + self.period})
        self.breaks = [breaks[0], *(b for a, b in pairwise(breaks) if b - a > mp.mpf(10) ** -40)]

    def _angles(self, index):
        """Angles of a stroke's points that lie between its dead centres."""
        m, found = self.motion, []
        for volume in self.curves[index].x:
            x = (volume - self.clearance) / self.area
            if 0 < x < m.high - m.low:
                mirrored = Motion(m.r, m.length, -m.e)
                angle = 2 * mp.pi - mirrored.angle_of(x) if index % 2 else m.angle_of(x)
                found.append(angle + 2 * mp.pi * (index // 2))
        return found

    def at(self, phi, before=False):
        """p, the magnitude V |dp/dV| or phi |dp/dphi|; ``before`` takes the limit from below at a dead centre."""
        if self.table:
            at = self.start + mp.fmod(phi - self.start + 4 * self.period, self.period)
            value, slope, _ = self.curves[0].at(at)
            return value, abs(slope * at)
        index, volume = self._where(phi, before)
        value, slope, _ = self.curves[index].at(volume)
        return value, abs(slope * volume)

    def _where(self, phi, before=False):
        at = self.motion.top + mp.fmod(phi - self.motion.top + 4 * self.period, self.period)
        turn = int(mp.floor((at - self.motion.top) / (2 * mp.pi)))
        rising = at - 2 * mp.pi * turn >= self.motion.bottom
        index = 2 * turn + int(rising)
        if before and any(abs(phi - b) < mp.mpf(10) ** -30 for b in self._centres()):
            index = (index - 1) % len(self.curves)
        return index, self.clearance + self.area * self.motion.position(at)

    def _centres(self):
        m = self.motion
        ends = [angle + 2 * mp.pi * k for k in range(len(self.curves) // 2) for angle in (m.top, m.bottom)]
        return [*ends, m.top + self.period]

    @cache  # noqa: B019
    def work_to(self, phi):
        """The integral of p dV from the cycle's start, phi within the first period."""
        if self.table:
            pieces = [b for b in self.breaks if b < phi]
            if not pieces:
                return mp.mpf(0)
            start = pieces[-1]
            rest = mp.quad(lambda a: self.at(a)[0] * self.area * self.motion.velocity(a), [start, phi])
            return (self.work_to(start) if start > self.breaks[0] else mp.mpf(0)) + rest
        total = mp.mpf(0)
        ends = self._centres()
        swept = self.area * (self.motion.high - self.motion.low)
        for index, curve in enumerate(self.curves):
            if phi <= ends[index]:
                break
            done = phi >= ends[index + 1]
            volume = self.clearance + self.area * self.motion.position(phi)
            first = self.clearance + (swept if index % 2 else 0)
            last = self.clearance + (0 if index % 2 else swept) if done else volume
            total += curve.at(last)[2] - curve.at(first)[2]
        return total


class Machine:
    """A case in 50 digits."""

    def __init__(self, case):
        groups = {**case["mechanism"], **case["cylinder"], **case["masses"]}
        x = {name: mp.mpf(value) for name, value in groups.items()}
        self.x, self.motion = x, Motion(x["crank_radius"], x["rod_length"], x["offset"])
        self.area = mp.pi * x["bore"] ** 2 / 4
        self.gas = Gas(case, self.motion, self.area, x["clearance_volume"])
        self.omega = 2 * mp.pi * x["speed"]
        share = x["rod_cg"] / x["rod_length"]
        self.big_end, small_end = x["rod"] * share, x["rod"] * (1 - share)
        self.reciprocating = x["piston"] + small_end
        self.defect = x["rod"] * x["rod_cg"] * (x["rod_length"] - x["rod_cg"]) - x["rod_inertia"]
        self.throw = x["crank_pin"]
        self.phases = [mp.mpf(p) for p in case.get("phases", [0])]

    def forces(self, phi, before=False):
        """{name: (value, sum of magnitudes)} of what the worst instants are taken from, and the torque."""
        p, steep = self.gas.at(phi, before)
        back, m = self.x["crankcase_pressure"], self.motion
        gas, gas_size = (p - back) * self.area, (abs(p) + steep + abs(back)) * self.area
        acceleration = m.acceleration(phi) * self.omega**2
        beta, _, bending = m.rod_angle(phi)
        axial = gas - self.reciprocating * acceleration
        grip = self.motion.r * self.omega**2
        # What the rounding of r, L and e does to the rod's tangent when the rod stands nearly across.
        askew = 1 / mp.cos(beta) ** 2
        size = gas_size + self.reciprocating * max(abs(acceleration) * askew, grip)
        couple = self.defect * bending * self.omega**2 / (m.length * mp.cos(beta))
        # The couple's defect is itself a difference, and so is beta''.
        two = self.x["rod"] * self.x["rod_cg"] * (m.length - self.x["rod_cg"]) + self.x["rod_inertia"]
        turning = (m.r / m.length) * self.omega**2 / mp.cos(beta) ** 3
        size_across = askew * size * mp.tan(abs(beta)) + two * turning / (m.length * mp.cos(beta))
        side = axial * mp.tan(beta) + couple
        tangential = axial * mp.sin(phi) + side * mp.cos(phi)
        radial = axial * mp.cos(phi) - side * mp.sin(phi)
        rod = mp.sign(axial) * mp.sqrt(axial**2 + side**2)
        on_pin = gas - self.x["piston"] * acceleration
        whole = size + size_across
        big_end, turning_mass = self.big_end * grip, (self.throw + self.big_end) * grip
        return {
            "gas_force_max": (gas, gas_size),
            "rod_compression_max": (rod, whole),
            "rod_tension_max": (-rod, whole),
            "side_force_max": (abs(side), size_across + size * mp.mpf(2) ** -53),
            "wrist_pin_load_max": (mp.sqrt(on_pin**2 + side**2), whole),
            "crank_pin_load_max": (mp.sqrt(tangential**2 + (radial - big_end) ** 2), whole + big_end),
            "main_bearing_load_max": (mp.sqrt(tangential**2 + (radial - turning_mass) ** 2), whole + turning_mass),
            "torque": (tangential * m.r, whole * m.r),
        }

    def energy(self, phi):
        """Work of one cylinder's torque since the cycle's start [J], any phi of the first two periods."""
        start, period = self.gas.breaks[0], self.gas.period
        cycles = int(mp.floor((phi - start) / period))
        at = phi - cycles * period
        back = self.x["crankcase_pressure"] * self.area * self.motion.position(at)
        return cycles * self.gas.work_to(start + period) + self.gas.work_to(at) - back - self.kinetic(at)

    def kinetic(self, phi):
        _, turning, _ = self.motion.rod_angle(phi)
        moving = self.reciprocating * self.motion.velocity(phi) ** 2 - self.defect * turning**2
        return moving * self.omega**2 / 2


def golden(function, low, high):
    """The greatest value between two places that hold one hump, to half the digits in place and all in value."""
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
    """The place of the greatest value, and whether it is the limit from below at a break.

    Every piece is looked at in ``parts`` of the cycle; in the best pieces the best place's neighbours are closed in on.
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
    """Mean torque and power of a cycle whose gas does this work, each with the sum of the magnitudes in it."""
    breaks, period = machine.gas.breaks, machine.gas.period
    positions = [machine.motion.position(b) for b in breaks]
    size = sum(
        max(abs(machine.gas.at(a)[0]), abs(machine.gas.at(b, True)[0])) * abs(x1 - x0) * machine.area
        for a, b, x0, x1 in zip(breaks, breaks[1:], positions, positions[1:], strict=False)
    )
    # Volumes are rounded as wholes, clearance and all.
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
            if not x["offset"]:
                found["brix_crank_angle"] = brix_angle(x["position"] / m.r, m.r / m.length)
        return found

    return _conditioned(values, inputs)


def brix_angle(x, lam):
    """From lam c^2/2 + c - (1 + lam/2 - x) = 0, c = cos phi."""
    c = (mp.sqrt(1 + 2 * lam * (1 + lam / 2 - x)) - 1) / lam if lam else 1 - x
    return mp.acos(c)


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
