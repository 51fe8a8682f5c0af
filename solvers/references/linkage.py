"""Reference for the impact linkage.

Ratios solve the closure and R_k = R as linear equations; joints are intersections of circles; u31 follows from joint
velocities and its derivative from differences; boxes are found by a search over directions.
"""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp

from solvers.references.searching import Number, golden_section, maximum, unwatched

DIGITS = 120
_ROUNDS = 45
_BOX_DIGITS = 30

SIGNS = {"largest_coupler": (1, 1), "largest_rocker": (1, -1), "largest_base": (-1, -1)}
"""Directions, along the base, of crank pin and rocker joint at the blow."""


def ratios(kind: str, restitution: float, parameter: float) -> tuple[mp.mpf, mp.mpf, mp.mpf]:
    """lambda0, lambda2, lambda3 from the closure and lambda0 lambda2 = g^2 lambda3, solved as linear equations."""
    r, p = mp.mpf(restitution), mp.mpf(parameter)
    square = ((1 + r) / (1 - r)) ** 2
    if kind == "largest_coupler":  # l0 + l3 = 1 + p, l0 p = g2 l3
        rocker = (1 + p) / (1 + square / p)
        return square * rocker / p, p, rocker
    if kind == "largest_rocker":  # l0 - l3 = 1 - p, l0 p = g2 l3
        rocker = (1 - p) / (square / p - 1)
        return square * rocker / p, p, rocker
    coupler = (1 + p) / (1 + p / square)  # l2 + l3 = 1 + p, p l2 = g2 l3
    return p, coupler, p * coupler / square


def rocker_angle(kind: str, links: tuple[mp.mpf, mp.mpf, mp.mpf], phi: mp.mpf) -> mp.mpf:
    """phi3 from the intersection of the circles around crank pin and rocker pivot, on the branch that moves outward
    after the blow."""
    base, coupler, rocker = links
    crank_sign, rocker_sign = SIGNS[kind]
    x, y = crank_sign * mp.cos(phi) - base, crank_sign * mp.sin(phi)
    distance = mp.sqrt(x * x + y * y)
    along = (rocker**2 + distance**2 - coupler**2) / (2 * distance)
    across = mp.sqrt(max(rocker**2 - along**2, mp.mpf(0)))
    found = []
    for side in (1, -1):
        cx = (along * x - side * across * y) / distance
        cy = (along * y + side * across * x) / distance
        found.append(mp.atan2(rocker_sign * cy, rocker_sign * cx))
    # Each branch stays on one side over the whole cycle; the rocker's sign follows from its motion.
    wanted = -1 if kind == "largest_base" else 1
    inside = [angle for angle in found if angle * wanted >= 0]
    return min(inside, key=abs) if len(inside) == 1 else found[0] if not inside else max(inside, key=abs)


def transfer(kind: str, links: tuple[mp.mpf, mp.mpf, mp.mpf], phi: mp.mpf) -> mp.mpf:
    """u31 = lambda1 sin(phi - phi2)/(lambda3 sin(phi3 - phi2)) from the joints' velocities."""
    base, _, rocker = links
    crank_sign, rocker_sign = SIGNS[kind]
    phi3 = rocker_angle(kind, links, phi)
    bx, by = crank_sign * mp.cos(phi), crank_sign * mp.sin(phi)
    rx, ry = rocker_sign * rocker * mp.cos(phi3), rocker_sign * rocker * mp.sin(phi3)
    # rigid coupler: its ends have equal velocity components along it
    dx, dy = base + rx - bx, ry - by
    return (-by * dx + bx * dy) / (-ry * dx + rx * dy)


class Mechanism:
    """A change-point mechanism with unit crank and unit energy, designed for R_k = R."""

    def __init__(self, kind, restitution, parameter, watch=unwatched):
        self.watch = watch
        self.kind, self.parameter = kind, parameter
        self.links = ratios(kind, restitution, parameter)
        base, coupler, rocker = self.links
        self.g = mp.sqrt(base * coupler / rocker)
        self.reach = base + 1 if kind == "largest_base" else base - 1
        self.start, self.end = (self.g - 1) / self.reach, (self.g + 1) / self.reach
        self.swing = 2 * mp.asin(min(self.g / base, mp.mpf(1)))
        self.nu = 2 * mp.asin(min(self.g / coupler, mp.mpf(1)))

    def u(self, phi):
        return transfer(self.kind, self.links, phi)

    def slope(self, phi):
        step = mp.mpf(10) ** -(mp.mp.dps // 4)
        return (self.u(phi + step) - self.u(phi - step)) / (2 * step)

    def torque(self, phi):
        return abs(2 * self.u(phi) * self.slope(phi) / self.end**2)

    def force(self, phi):
        base, coupler, rocker = self.links
        crank_sign, rocker_sign = SIGNS[self.kind]
        phi3 = rocker_angle(self.kind, self.links, phi)
        x = base + rocker_sign * rocker * mp.cos(phi3) - crank_sign * mp.cos(phi)
        y = rocker_sign * rocker * mp.sin(phi3) - crank_sign * mp.sin(phi)
        lever = abs(x * mp.sin(phi3) - y * mp.cos(phi3)) * rocker / coupler
        return 2 / self.end**2 * abs(self.slope(phi)) / lever

    def extent(self, alpha):
        """Extent of the swept area in the direction alpha [rad]."""
        self.watch()
        base, _, rocker = self.links
        _, rocker_sign = SIGNS[self.kind]
        turn = self.swing if self.kind != "largest_base" else -self.swing
        first = mp.mpf(0) if rocker_sign > 0 else mp.pi
        out = mp.mpf(0)
        for beta in (alpha, alpha + mp.pi):
            c = mp.cos(beta)
            best = max(mp.mpf(1), base * c)
            for angle in (first, first + turn):
                best = max(best, base * c + rocker * mp.cos(beta - angle))
            low, high = sorted((first, first + turn))
            if (beta - low) - 2 * mp.pi * mp.floor((beta - low) / (2 * mp.pi)) <= high - low:
                best = max(best, base * c + rocker)
            out += best
        return out

    def area(self, alpha, pad=0):
        """Area of the bounding box with a side in the direction alpha [rad], with ``pad`` on every side."""
        return (self.extent(alpha) + 2 * pad) * (self.extent(alpha + mp.pi / 2) + 2 * pad)


def cycle_angles():
    """Crank angles over the cycle [rad]: uniform, and graded towards mid-cycle and both ends."""
    near = mp.mpf(10) ** -(mp.mp.dps // 6)
    out = {near, 2 * mp.pi - near} | {2 * mp.pi * i / 64 for i in range(1, 64)}
    for k in range(1, 40):
        d = mp.mpf(10) ** (-mp.mpf(k) / 4)
        out |= {mp.pi - d, mp.pi + d, d, 2 * mp.pi - d}
    return sorted(out)


def smallest_box(mechanism, pad=0):
    """(direction, area) of the smallest box."""
    angles = [mp.pi / 2 * i / 360 for i in range(361)]
    values = [mechanism.area(x, pad) for x in angles]
    least = min(values)
    best = None
    for i, value in enumerate(values):
        neighbours = values[max(i - 1, 0)], values[min(i + 1, len(values) - 1)]
        if value <= least * mp.mpf("1.01") and value <= min(neighbours):
            low, high = angles[max(i - 1, 0)], angles[min(i + 1, len(values) - 1)]
            at, found = golden_section(lambda x: -mechanism.area(x, pad), low, high, 3 * mp.mp.dps)
            best = min([best, (at, -found)] if best else [(at, -found)], key=lambda pair: pair[1])
    return best


def strike(
    kind: str, restitution: float, parameter: float, energy: bool, watch: Callable[[], None]
) -> dict[str, tuple[Number, float]]:
    """name -> (value, relative uncertainty) of a linkage with unit crank.

    |u31| after and before the blow and its maximum, R_k, the mid-cycle transmission angle [rad], the longest link; with
    ``energy``, peak torque and pin force for an impact energy of 1.
    """
    with mp.workdps(DIGITS):
        mechanism = Mechanism(kind, restitution, parameter)
        angles = cycle_angles()

        def watched(value):
            def look(phi):
                watch()
                return value(phi)

            return look

        found = {
            "start": mechanism.start,
            "end": mechanism.end,
            "greatest": max(mechanism.end, maximum(watched(lambda phi: abs(mechanism.u(phi))), angles, _ROUNDS)[1]),
            "restitution": (mechanism.g - 1) / (mechanism.g + 1),
            "transmission_angle": mechanism.nu,
            "rocker": mechanism.links[2],
            "longest": max(mp.mpf(1), *mechanism.links),
        }
        if energy:
            found["torque"] = maximum(watched(mechanism.torque), angles, _ROUNDS)[1]
            found["force"] = maximum(watched(mechanism.force), angles, _ROUNDS)[1]
        return {name: (+value, 0.0) for name, value in found.items()}


def box_area(kind: str, restitution: float, parameter: float, pad: Number, watch: Callable[[], None]) -> Number:
    """Area of the smallest box around the swept area of a unit-crank linkage, with ``pad`` on every side."""
    with mp.workdps(_BOX_DIGITS):
        mechanism = Mechanism(kind, restitution, parameter, watch)
        return smallest_box(mechanism, mp.mpf(pad))[1]
