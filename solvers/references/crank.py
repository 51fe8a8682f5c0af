"""Reference for the cycle of a crank mechanism.

Positions follow from Pythagoras' theorem and derivatives by differentiating the root; forces from the rod angle; the
work of the gas from the antiderivative of the diagram, that of the masses from their kinetic energy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import mpmath as mp

from solvers.references.monotone_cubic import Cubic
from solvers.references.searching import Number, gauss, local_maxima, refined_maximum

Case = Mapping[str, Any]
"""``mechanism`` {crank_radius, rod_length, speed, offset}, ``cylinder`` {bore, clearance_volume, crankcase_pressure,
strokes}, ``masses`` {piston, rod, rod_cg, rod_inertia, crank_pin}, ``pressure`` a table or an indicator diagram's
strokes, ``phases``; SI units. ``left_out`` names effects: reciprocating_inertia, rod_inertia_couple."""

DIGITS = 34
_SAMPLES = 1_440
_ORDER, _CHECKED = 20, 26
_PANEL = 0.2
_CANDIDATE_RANGE = 1e-3
_MAX_REFINED = 6
_INWARD = mp.mpf(10) ** -9


class Motion:
    """Piston displacement x(phi) = H - r cos phi - sqrt(L^2 - (r sin phi - e)^2), its derivatives and its inverse."""

    def __init__(self, r: Number, length: Number, e: Number, numbers: Any = mp) -> None:
        self.r, self.length, self.e, self.m = r, length, e, numbers
        self.high = numbers.sqrt((length + r) ** 2 - e**2)
        self.low = numbers.sqrt((length - r) ** 2 - e**2)
        self.top, self.bottom = numbers.asin(e / (length + r)), numbers.pi + numbers.asin(e / (length - r))

    def _root(self, phi):
        s = self.r * self.m.sin(phi) - self.e
        return s, self.m.sqrt(self.length**2 - s**2)

    def position(self, phi):
        return self.high - self.r * self.m.cos(phi) - self._root(phi)[1]

    def velocity(self, phi):
        s, c = self._root(phi)
        return self.r * self.m.sin(phi) + s * self.r * self.m.cos(phi) / c

    def acceleration(self, phi):
        s, c = self._root(phi)
        first, second = self.r * self.m.cos(phi), -self.r * self.m.sin(phi)
        return self.r * self.m.cos(phi) + (first**2 + s * second) / c + (s * first) ** 2 / c**3

    def rod_angle(self, phi):
        """Rod angle beta and its first two derivatives with respect to phi."""
        s, c = self._root(phi)
        first, second = self.r * self.m.cos(phi), -self.r * self.m.sin(phi)
        return self.m.asin(s / self.length), first / c, second / c + s * first**2 / c**3

    def angle_of(self, x):
        """Crank angle of position x on the downstroke, from the half-angle form of the law of cosines."""
        m, height = self.m, self.high - x
        d = m.sqrt(height**2 + self.e**2)
        r, length = self.r, self.length
        above, below = (length + r - d) * (length - r + d), (r + d - length) * (r + d + length)
        return m.atan2(self.e, height) + 2 * m.atan2(m.sqrt(above), m.sqrt(below))


class Gas:
    """Pressure as a function of the crank angle, from a table or the strokes of an indicator diagram.

    ``integrate`` is used for integrals without a closed form.
    """

    def __init__(self, case: Case, motion: Motion, area: Number, clearance: Number, integrate: Callable) -> None:
        self.motion, self.area, self.clearance, self.integrate = motion, area, clearance, integrate
        m = self.m = motion.m
        self.tolerance = m.mpf(10) ** -30 if m is mp else 1e-12
        self.period = case["cylinder"]["strokes"] * m.pi
        pressure = case["pressure"]
        self.table = pressure["kind"] == "table"
        if self.table:
            angle, values = [m.mpf(a) for a in pressure["angle"]], [m.mpf(p) for p in pressure["pressure"]]
            if angle[-1] - angle[0] < self.period * (1 - m.mpf("1e-9")):
                angle, values = [*angle, angle[0] + self.period], [*values, values[0]]
            self.start, self.curves = angle[0], [Cubic(angle, values, True, m)]
            inside = [motion.top + m.fmod(a - motion.top + 4 * self.period, self.period) for a in angle]
        else:
            self.curves = []
            for stroke in pressure["strokes"]:
                points = sorted(zip(stroke["volume"], stroke["pressure"], strict=True))
                self.curves.append(Cubic([m.mpf(v) for v, _ in points], [m.mpf(p) for _, p in points], False, m))
            inside = [angle for index in range(len(self.curves)) for angle in self._angles(index)]
        dead_centres = [motion.top, motion.bottom]
        centres = [angle + 2 * m.pi * k for k in range(case["cylinder"]["strokes"] // 2) for angle in dead_centres]
        breaks = sorted({*centres, *inside, motion.top + self.period})
        min_distance = m.mpf(10) ** -40 if m is mp else 1e-13
        self.breaks = [breaks[0], *(b for a, b in pairwise(breaks) if b - a > min_distance)]
        self.work_to = cache(self._work_to)

    def _angles(self, index):
        """Crank angles of the points of a stroke between its dead centres."""
        m, found = self.motion, []
        for volume in self.curves[index].x:
            x = (volume - self.clearance) / self.area
            if 0 < x < m.high - m.low:
                mirrored = Motion(m.r, m.length, -m.e, self.m)
                angle = 2 * self.m.pi - mirrored.angle_of(x) if index % 2 else m.angle_of(x)
                found.append(angle + 2 * self.m.pi * (index // 2))
        return found

    def at(self, phi, before=False):
        """Pressure and its sensitivity V |dp/dV| or phi |dp/dphi|; ``before`` takes the left limit at a dead centre."""
        if self.table:
            at = self.start + self.m.fmod(phi - self.start + 4 * self.period, self.period)
            value, slope, _ = self.curves[0].at(at)
            return value, abs(slope * at)
        index, volume = self._stroke_at(phi, before)
        value, slope, _ = self.curves[index].at(volume)
        return value, abs(slope * volume)

    def _stroke_at(self, phi, before=False):
        at = self.motion.top + self.m.fmod(phi - self.motion.top + 4 * self.period, self.period)
        turn = int(self.m.floor((at - self.motion.top) / (2 * self.m.pi)))
        rising = at - 2 * self.m.pi * turn >= self.motion.bottom
        index = (2 * turn + int(rising)) % len(self.curves)
        if before and any(abs(phi - b) < self.tolerance for b in self._dead_centres()):
            index = (index - 1) % len(self.curves)
        return index, self.clearance + self.area * self.motion.position(at)

    def _dead_centres(self):
        m = self.motion
        ends = [angle + 2 * self.m.pi * k for k in range(len(self.curves) // 2) for angle in (m.top, m.bottom)]
        return [*ends, m.top + self.period]

    def _work_to(self, phi):
        """Integral of p dV from the start of the cycle to phi within the first period [J]."""
        if self.table:
            pieces = [b for b in self.breaks if b < phi]
            if not pieces:
                return self.m.mpf(0)
            start = pieces[-1]
            rest = self.integrate(lambda a: self.at(a)[0] * self.area * self.motion.velocity(a), [start, phi])
            return (self.work_to(start) if start > self.breaks[0] else self.m.mpf(0)) + rest
        total = self.m.mpf(0)
        ends = self._dead_centres()
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
    """The machine of a case, in the numbers of an mpmath context."""

    def __init__(self, case: Case, numbers: Any = mp, integrate: Callable | None = None) -> None:
        groups = {**case["mechanism"], **case["cylinder"], **case["masses"]}
        m = self.m = numbers
        x = {name: m.mpf(value) for name, value in groups.items()}
        self.x, self.motion = x, Motion(x["crank_radius"], x["rod_length"], x["offset"], m)
        self.area = m.pi * x["bore"] ** 2 / 4
        self.gas = Gas(case, self.motion, self.area, x["clearance_volume"], integrate or m.quad)
        self.omega = 2 * m.pi * x["speed"]
        share = x["rod_cg"] / x["rod_length"]
        self.big_end, small_end = x["rod"] * share, x["rod"] * (1 - share)
        left_out = case.get("left_out", ())
        without_inertia = "reciprocating_inertia" in left_out
        self.piston = m.mpf(0) if without_inertia else x["piston"]
        self.reciprocating = m.mpf(0) if without_inertia else x["piston"] + small_end
        self.defect = x["rod"] * x["rod_cg"] * (x["rod_length"] - x["rod_cg"]) - x["rod_inertia"]
        if "rod_inertia_couple" in left_out:
            self.defect = m.mpf(0)
        self.throw = x["crank_pin"]
        self.rods_per_pin = case.get("rods_per_pin", 1)
        self.phases = [m.mpf(p) for p in case.get("phases", [0])]

    def forces(self, phi, before=False):
        """{name: (value, sum of the magnitudes of its terms)} of the forces with wanted maxima, and of the torque."""
        p, sensitivity = self.gas.at(phi, before)
        m, back, motion = self.m, self.x["crankcase_pressure"], self.motion
        gas, gas_size = (p - back) * self.area, (abs(p) + sensitivity + abs(back)) * self.area
        acceleration = motion.acceleration(phi) * self.omega**2
        beta, _, beta_second = motion.rod_angle(phi)
        axial = gas - self.reciprocating * acceleration
        centripetal = motion.r * self.omega**2
        # rounding of r, L and e amplified by the rod's tangent when the rod is nearly transverse
        amplification = 1 / m.cos(beta) ** 2
        size = gas_size + self.reciprocating * max(abs(acceleration) * amplification, centripetal)
        couple = self.defect * beta_second * self.omega**2 / (motion.length * m.cos(beta))
        # the inertia defect and beta'' in the couple are differences themselves
        two = self.x["rod"] * self.x["rod_cg"] * (motion.length - self.x["rod_cg"]) + self.x["rod_inertia"]
        angular = (motion.r / motion.length) * self.omega**2 / m.cos(beta) ** 3
        size_across = amplification * size * m.tan(abs(beta)) + two * angular / (motion.length * m.cos(beta))
        side = axial * m.tan(beta) + couple
        tangential = axial * m.sin(phi) + side * m.cos(phi)
        radial = axial * m.cos(phi) - side * m.sin(phi)
        rod = axial * m.cos(beta) + side * m.sin(beta)
        on_pin = gas - self.piston * acceleration
        whole = size + size_across
        big_end = self.big_end * centripetal
        rotating = (self.throw + self.rods_per_pin * self.big_end) * centripetal
        return {
            "gas_force_max": (gas, gas_size),
            "rod_compression_max": (rod, whole),
            "rod_tension_max": (-rod, whole),
            "side_force_max": (abs(side), size_across + size * m.mpf(2) ** -53),
            "wrist_pin_load_max": (m.sqrt(on_pin**2 + side**2), whole),
            "crank_pin_load_max": (m.sqrt(tangential**2 + (radial - big_end) ** 2), whole + big_end),
            "main_bearing_load_max": (m.sqrt(tangential**2 + (radial - rotating) ** 2), whole + rotating),
            "torque": (tangential * motion.r, whole * motion.r),
        }

    def energy(self, phi):
        """Work of one cylinder's torque since the start of the cycle [J], for phi in the first two periods."""
        start, period = self.gas.breaks[0], self.gas.period
        cycles = int(self.m.floor((phi - start) / period))
        at = phi - cycles * period
        back = self.x["crankcase_pressure"] * self.area * self.motion.position(at)
        return cycles * self.gas.work_to(start + period) + self.gas.work_to(at) - back - self.kinetic(at)

    def kinetic(self, phi):
        """Kinetic energy of the moving masses [J]."""
        _, angular, _ = self.motion.rod_angle(phi)
        moving = self.reciprocating * self.motion.velocity(phi) ** 2 - self.defect * angular**2
        return moving * self.omega**2 / 2

    def mean_torque(self):
        """Mean torque of all cylinders together [N m]."""
        start, period = self.gas.breaks[0], self.gas.period
        return len(self.phases) * self.gas.work_to(start + period) / period

    def excess_work(self, phi):
        """Work of all cylinders in excess of that of the mean torque [J], for phi in the first period."""
        period = self.gas.period
        done = self.m.fsum([self.energy(phi - psi + 2 * period) for psi in self.phases])
        return done - self.mean_torque() * (phi + 2 * period)

    def shifted_breaks(self):
        """Breakpoints of all cylinders' cycles over the first period."""
        breaks, period = self.gas.breaks, self.gas.period
        shifted = (breaks[0] + self.m.fmod(b + psi - breaks[0], period) for b in breaks for psi in self.phases)
        found = sorted({breaks[0], *shifted})
        return [*found, breaks[0] + period] if found[-1] < breaks[0] + period else found


def panels(order: int, numbers: Any = mp) -> Callable:
    """Gauss quadrature on equal panels, short compared with the variation of the motion."""

    def integrate(f, ends):
        low, high = ends
        count = max(1, int((high - low) / _PANEL) + 1)
        edges = [low + (high - low) * k / count for k in range(count + 1)]
        pairs = (pair for a, b in pairwise(edges) for pair in gauss(a, b, order))
        if numbers is mp:
            return mp.fsum(f(x) * w for x, w in pairs)
        return sum(f(float(x)) * float(w) for x, w in pairs)

    return integrate


WORST = ("rod_compression_max", "side_force_max", "wrist_pin_load_max", "crank_pin_load_max", "main_bearing_load_max")


def cycle(case: Case, watch: Callable[[], None]) -> dict[str, tuple[Number, float]]:
    """name -> (value, relative uncertainty) of the maximum forces [N], mean torque [N m], indicated power [W] and the
    work between the speed extremes [J].

    Every interval between breaks is sampled densely in floats; candidates near the maximum are refined in high
    precision.
    """
    with mp.workdps(DIGITS):
        rough, exact = Machine(case, mp.fp, panels(6, mp.fp)), Machine(case, mp.mp, panels(_ORDER))
        sampled = [
            (grid, [rough.forces(a, k == len(grid) - 1) for k, a in enumerate(grid)])
            for grid in _grids(rough.gas.breaks, watch)
        ]
        found = {}
        for name in WORST:
            samples = [(grid, [forces[name][0] for forces in row]) for grid, row in sampled]

            def force(angle, before=False, name=name):
                watch()
                return exact.forces(angle, before)[name][0]

            found[name] = (_greatest(force, samples, exact.gas.breaks), 0.0)
        work = exact.gas.work_to(exact.gas.breaks[0] + exact.gas.period)
        checked = Machine(case, mp.mp, panels(_CHECKED)).gas
        uncertainty = abs(checked.work_to(checked.breaks[0] + checked.period) - work)
        relative = float(uncertainty / abs(work)) if work else 0.0
        found["mean_torque"] = (work / exact.gas.period, relative)
        found["indicated_power"] = (work * exact.x["speed"] * 2 * mp.pi / exact.gas.period, relative)
        samples = [(grid, [rough.excess_work(a) for a in grid]) for grid in _grids(rough.shifted_breaks(), watch)]

        def excess_work(angle, _before=False, sign=1):
            watch()
            return sign * exact.excess_work(angle)

        high = _greatest(excess_work, samples, exact.shifted_breaks())
        negated = [(grid, [-value for value in row]) for grid, row in samples]
        low = _greatest(lambda a, b=False: excess_work(a, b, -1), negated, exact.shifted_breaks())
        total = len(exact.phases) * 2 * uncertainty
        found["work_fluctuation"] = (high + low, float(total / (high + low)) if high + low else 0.0)
        return {name: (+value, error) for name, (value, error) in found.items()}


def _grids(breaks: Sequence[float], watch: Callable[[], None]) -> list[list[float]]:
    """Sample points of each interval, including both ends."""
    found, whole = [], breaks[-1] - breaks[0]
    for low, high in pairwise(breaks):
        watch()
        count = max(6, int(_SAMPLES * (high - low) / whole))
        found.append([*(low + (high - low) * k / count for k in range(count)), high])
    return found


def _greatest(function: Callable, samples: list[tuple[list[float], list[float]]], breaks: Sequence[Number]) -> Number:
    """The maximum, refined at all samples close to it, including both sides of the breaks."""
    sampled = [value for _, row in samples for value in row]
    least = max(sampled) - _CANDIDATE_RANGE * (max(sampled) - min(sampled))
    candidates = [(row[i], grid, i) for grid, row in samples for i in local_maxima(row, 1.0) if row[i] >= least]
    values = []
    for _, grid, i in sorted(candidates, key=lambda entry: entry[0], reverse=True)[:_MAX_REFINED]:
        last = len(grid) - 1
        low, high = mp.mpf(grid[max(i - 1, 0)]), mp.mpf(grid[min(i + 1, last)])
        if i not in (0, last):
            values.append(refined_maximum(function, low, mp.mpf(grid[i]), high)[1])
            continue
        end = min(breaks, key=lambda b, at=grid[i]: abs(b - at))
        values.append(function(end, i == last))
        inward = (high - low) * (_INWARD if i == 0 else -_INWARD)
        # a break from which the function falls is the maximum; refine only if it rises further
        if function(end + inward) > values[-1]:
            values.append(refined_maximum(function, low, (low + high) / 2, high)[1])
    return max(values)
