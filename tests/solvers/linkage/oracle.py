"""The raw loop equation at many digits: an oracle that shares no formula with the code."""

from __future__ import annotations

import mpmath as mp

SIGNS = {"largest_coupler": (1, 1), "largest_rocker": (1, -1), "largest_base": (-1, -1)}
"""Where crank pin and rocker joint lie at the blow, along the base."""


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
    """phi3 by intersecting the circles about crank pin and rocker pivot, on the branch that leaves the blow outward."""
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
    # One branch swings to one side only over the whole cycle; for the rocker's sign see the sign of its motion.
    wanted = -1 if kind == "largest_base" else 1
    inside = [angle for angle in found if angle * wanted >= 0]
    return min(inside, key=abs) if len(inside) == 1 else found[0] if not inside else max(inside, key=abs)


def transfer(kind: str, links: tuple[mp.mpf, mp.mpf, mp.mpf], phi: mp.mpf) -> mp.mpf:
    """u31 = lambda1 sin(phi - phi2)/(lambda3 sin(phi3 - phi2)) from the joints' velocities."""
    base, _, rocker = links
    crank_sign, rocker_sign = SIGNS[kind]
    swung = rocker_angle(kind, links, phi)
    bx, by = crank_sign * mp.cos(phi), crank_sign * mp.sin(phi)
    rx, ry = rocker_sign * rocker * mp.cos(swung), rocker_sign * rocker * mp.sin(swung)
    # Rigid coupler: its ends have equal velocities along it.
    dx, dy = base + rx - bx, ry - by
    return (-by * dx + bx * dy) / (-ry * dx + rx * dy)
