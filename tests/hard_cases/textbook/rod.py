"""The strip as a textbook writes it: one family of functions for each sign of the axial force, in floats.

V = A (cos Kz - 1) + B (sin Kz - Kz) in compression, its hyperbolic counterpart in tension, a cubic without a force;
A and B by Cramer's rule from the two conditions at the head; extremes read off a grid of angles and sections.
"""

from __future__ import annotations

import numpy as np

ANGLES, SECTIONS, REPEATS = 720, 41, 100


def families(q, z):
    """Both functions with three derivatives each, for arrays q and z of one shape."""
    k = np.sqrt(abs(q))
    one, nought = np.ones_like(z), np.zeros_like(z)
    c, s = np.where(q < 0, np.cos(k * z), np.cosh(k * z)), np.where(q < 0, np.sin(k * z), np.sinh(k * z))
    sign = np.sign(q)
    f = [c - 1, sign * k * s, sign * k**2 * c, k**3 * s]
    g = [s - k * z, k * c - k, sign * k**2 * s, sign * k**3 * c]
    if np.any(q == 0):
        plain_f, plain_g = [z**2 / 2, z, one, nought], [z**3 / 6, z**2 / 2, z, one]
        f = [np.where(q == 0, a, b) for a, b in zip(plain_f, f, strict=True)]
        g = [np.where(q == 0, a, b) for a, b in zip(plain_g, g, strict=True)]
    return f, g


def bent(q, l, rod_length, z):
    """V, V', V'' and V''' per unit lateral displacement at z."""
    with np.errstate(all="ignore"):
        q, z = np.broadcast_arrays(np.asarray(q, dtype=float), np.asarray(z, dtype=float))
        f, g = families(q, np.full(z.shape, float(l)))
        e = rod_length - l
        a11, a12, a21, a22 = f[0] + e * f[1], g[0] + e * g[1], f[2] + e * f[3], g[2] + e * g[3]
        det = a11 * a22 - a12 * a21
        f, g = families(q, z)
        return [(a22 * u - a21 * v) / det for u, v in zip(f, g, strict=True)]


def kernel(q, l, rod_length):
    """The values of a kernel case by name."""
    start, end = bent(q, l, rod_length, np.zeros(1)), bent(q, l, rod_length, np.array([l]))
    values = {"clamp_curvature": start[2][0], "clamp_shear": start[3][0], "head_curvature": end[2][0]}
    for i in (1, 2, 3, 4):
        at = bent(q, l, rod_length, np.array([l * i / 4]))
        values[f"curvature_{i}"], values[f"deflection_{i}"] = at[2][0], at[0][0]
    return values


def check(scene, strip):
    """Fatigue and yield safety, side force and clamp moment of a scene whose axial force is the gas load's alone."""
    angle = 2 * np.pi * np.arange(ANGLES) / ANGLES
    force = -(scene.load.pressure(angle) - scene.load.reference_pressure()) * scene.piston.area
    stiffness = scene.material.elastic_modulus * strip.b * strip.h**3 / 12
    z = np.linspace(0.0, strip.l, SECTIONS)[:, None]
    lateral = scene.mechanism.crank_radius * np.sin(angle)
    with np.errstate(all="ignore"):
        v = bent((force / stiffness)[None, :], strip.l, scene.mechanism.rod_length, z)
        bending = 0.5 * scene.material.elastic_modulus * strip.h * v[2] * lateral
        stress = np.stack([force / (strip.b * strip.h) + bending, force / (strip.b * strip.h) - bending])
        high, low = stress.max(axis=2), stress.min(axis=2)
        m = scene.material
        mean = np.maximum((high + low) / 2, 0)
        use = (m.fatigue_reduction * (high - low) / 2 + m.mean_stress_sensitivity * mean) / m.fatigue_limit
        return {
            "fatigue_safety": 1 / use.max(),
            "yield_safety": m.yield_strength / abs(stress).max(),
            "side_force_max": abs(stiffness * v[3][0] * lateral).max(),
            "clamp_moment_max": abs(stiffness * v[2][0] * lateral).max(),
        }


def fed_back(scene, strip, angle):
    """The axial force including friction at an angle, by fixed-point iteration."""
    piston = scene.piston
    plain = -float(scene.load.pressure(np.array([angle]))[0] - scene.load.reference_pressure()) * piston.area
    stiffness = scene.material.elastic_modulus * strip.b * strip.h**3 / 12
    lateral, force = scene.mechanism.crank_radius * np.sin(angle), plain
    with np.errstate(all="ignore"):
        for _ in range(REPEATS):
            _, _, second, third = bent(force / stiffness, strip.l, scene.mechanism.rod_length, np.zeros(1))
            side, moment = -stiffness * third[0] * lateral, stiffness * second[0] * lateral
            couple = 6 * abs(moment + side * piston.clamp_offset) / piston.skirt_length
            wall = abs(side) if couple <= abs(side) else (couple + side**2 / couple) / 2
            force = plain + np.sign(lateral) * piston.friction_coefficient * 4 / np.pi * wall
    return force
