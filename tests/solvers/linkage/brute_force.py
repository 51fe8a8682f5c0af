"""The same questions answered without insight: joints by intersecting circles, sweeps and searches by sampling."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

SIGNS = {"largest_coupler": (1, 1), "largest_rocker": (1, -1), "largest_base": (-1, -1)}


def ratios(kind: str, restitution: float, p: float) -> tuple[float, float, float]:
    """lambda0, lambda2, lambda3 of the family."""
    square = ((1 + restitution) / (1 - restitution)) ** 2
    if kind == "largest_coupler":
        return square * (1 + p) / (square + p), p, p * (p + 1) / (p + square)
    if kind == "largest_rocker":
        return square * (p - 1) / (p - square), p, p * (p - 1) / (p - square)
    return p, square * (p + 1) / (p + square), p * (p + 1) / (p + square)


@dataclass(frozen=True)
class Cycle:
    """Crank angles and joints over a cycle, ends included; lengths base, crank, coupler, rocker."""

    lengths: tuple[float, float, float, float]
    phi: np.ndarray
    pin: np.ndarray
    joint: np.ndarray
    rocker_angle: np.ndarray


def cycle(kind: str, lengths: tuple[float, float, float, float], samples: int = 3001) -> Cycle:
    """The branch on which the rocker leaves the blow and comes back to it."""
    base, crank, coupler, rocker = lengths
    crank_sign, rocker_sign = SIGNS[kind]
    phi = np.linspace(0, 2 * math.pi, samples)
    pin = crank * crank_sign * np.stack([np.cos(phi), np.sin(phi)])
    x, y = pin[0] - base, pin[1]
    distance = np.hypot(x, y)
    along = (rocker**2 + distance**2 - coupler**2) / (2 * distance)
    across = np.sqrt(np.maximum(rocker**2 - along**2, 0))
    for side in (1, -1):
        cx, cy = (along * x - side * across * y) / distance, (along * y + side * across * x) / distance
        angle = np.unwrap(np.arctan2(rocker_sign * cy, rocker_sign * cx))
        if np.all(angle[1:-1] * (-1 if kind == "largest_base" else 1) >= -1e-7):
            return Cycle(lengths, phi, pin, np.stack([base + cx, cy]), angle)
    raise AssertionError("no branch stays on one side")


def minimum_box(swept: Cycle, pad: float) -> tuple[float, float]:
    """(area, angle) by trying directions, then more around the best."""
    points = np.hstack([swept.pin, swept.joint, [[0.0, swept.lengths[0]], [0.0, 0.0]]])

    def areas(angles: np.ndarray) -> np.ndarray:
        cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
        along, across = cosine * points[0] + sine * points[1], cosine * points[1] - sine * points[0]
        return (np.ptp(along, axis=1) + 2 * pad) * (np.ptp(across, axis=1) + 2 * pad)

    at, step = 0.25 * math.pi, 0.25 * math.pi
    for _ in range(4):
        tried = np.linspace(at - step, at + step, 241)
        found = areas(tried)
        at, step = float(tried[np.argmin(found)]), step / 60
    return float(found.min()), at


def enclosing_radius(swept: Cycle, pad: float) -> float:
    """Least greatest distance, climbed down from several places."""
    points = np.hstack([swept.pin, swept.joint, [[0.0, swept.lengths[0]], [0.0, 0.0]]])

    def reach(centre: np.ndarray) -> float:
        return float(np.hypot(*(points - centre[:, None])).max())

    size = float(np.ptp(points))
    best = min(
        (minimize(reach, start, method="Nelder-Mead", options={"xatol": 1e-10 * size, "fatol": 1e-12 * size})
         for start in (points.mean(axis=1), points.max(axis=1) / 2, np.array([swept.lengths[0] / 2, 0.0]))),
        key=lambda found: found.fun,
    )  # fmt: skip
    return best.fun + pad


def loads(swept: Cycle, energy: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Crank angles between the ends, crank torque and force along the coupler, from the rocker's angle by differences.

    The rocker's inertia alone is moved; the force acts along the coupler, at its lever about the rocker's pivot.
    """
    step = swept.phi[1] - swept.phi[0]
    f = swept.rocker_angle
    speed = (f[:-4] - 8 * f[1:-3] + 8 * f[3:-1] - f[4:]) / (12 * step)
    change = (-f[:-4] + 16 * f[1:-3] - 30 * f[2:-2] + 16 * f[3:-1] - f[4:]) / (12 * step**2)
    end = (3 * f[-5] - 16 * f[-4] + 36 * f[-3] - 48 * f[-2] + 25 * f[-1]) / (12 * step)
    inertia = 2 * energy / end**2  # times omega^2
    base = np.array([[swept.lengths[0]], [0.0]])
    arm, rod = (swept.joint - base)[:, 2:-2], (swept.joint - swept.pin)[:, 2:-2]
    lever = np.abs(arm[0] * rod[1] - arm[1] * rod[0]) / swept.lengths[2]
    return swept.phi[2:-2], inertia * speed * change, inertia * np.abs(change) / lever
