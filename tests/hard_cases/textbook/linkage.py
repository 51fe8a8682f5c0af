"""The linkage as a textbook writes it: angles from arccosines, the transfer function from sines of differences."""

from __future__ import annotations

import numpy as np

from solvers.references.linkage import SIGNS


def ratios(kind, restitution, parameter):
    """lambda0, lambda2, lambda3 of a family."""
    square, p = ((1 + restitution) / (1 - restitution)) ** 2, parameter
    if kind == "largest_coupler":
        return square * (1 + p) / (square + p), p, p * (p + 1) / (p + square)
    if kind == "largest_rocker":
        return square * (p - 1) / (p - square), p, p * (p - 1) / (p - square)
    return p, square * (p + 1) / (p + square), p * (p + 1) / (p + square)


def transfer(kind, restitution, parameter, phi):
    """u31 = sin(phi - phi2)/(lambda3 sin(phi3 - phi2)), the angles by the law of cosines about the diagonal."""
    base, coupler, rocker = ratios(kind, restitution, parameter)
    crank_sign, rocker_sign = SIGNS[kind]
    with np.errstate(all="ignore"):
        at = np.float64(phi if phi > 0 else 2 * np.pi + phi)
        x, y = crank_sign * np.cos(at), crank_sign * np.sin(at)
        diagonal = np.hypot(base - x, y)
        inward = np.arctan2(y, x - base)
        opening = np.arccos((rocker**2 + diagonal**2 - coupler**2) / (2 * rocker * diagonal))
        swings = (inward - opening, inward + opening)
        wanted = -1 if kind == "largest_base" else 1
        # The branch that swings to one side only over the cycle.
        turned = [(s - (np.pi if rocker_sign < 0 else 0.0)) for s in swings]
        turned = [np.arctan2(np.sin(s), np.cos(s)) for s in turned]
        inside = [i for i in (0, 1) if turned[i] * wanted >= 0]
        pick = inside[0] if len(inside) == 1 else int(np.argmax(np.abs(turned))) if inside else 0
        third = swings[pick]
        second = np.arctan2(rocker * np.sin(third) - y, base + rocker * np.cos(third) - x)
        first = np.arctan2(y, x)
        return float(np.sin(first - second) / (rocker * np.sin(third - second)))


def told_by_lengths(name, kind, base, crank, coupler, rocker):
    """R, or the angle at which the crank or the rocker stops."""
    with np.errstate(all="ignore"):
        if name == "restitution":
            g = np.sqrt(base * coupler / (rocker * crank))
            return float((g - 1) / (g + 1))
        if name == "blocked":
            apart = coupler + rocker if kind == "largest_base" else coupler - rocker
            cosine = (base**2 + crank**2 - apart**2) / (2 * base * crank)
            return float(np.arccos(-cosine if kind == "largest_base" else cosine))
        apart = coupler + crank if kind == "largest_coupler" else coupler - crank
        cosine = (base**2 + rocker**2 - apart**2) / (2 * base * rocker)
        return float(np.arccos(-cosine if kind == "largest_coupler" else cosine))
