"""Pins that several tests share."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np

from solvers import pin
from solvers.pin.effects import Physics
from solvers.pin.optimum.program import assemble
from solvers.pin.section.flexibility import densities
from solvers.pin.shapes.free import Free
from solvers.pin.stations.lobatto_panels import initial_stations

GEOMETRY = pin.Geometry(21.99e-3, 24e-3, 30e-3, 1e-3)
STEEL = pin.PinMaterial(150e6, 210e9, 0.3, 7850.0)
VAZ = pin.Scene(GEOMETRY, 15e3, STEEL)
PAPER = pin.CRITERIA["tresca_paper"]
BENDING_ONLY = pin.EffectSelection(exclude=frozenset({"shear_deflection"}))


def vaz(force=15e3, **material):
    values = {"allowable_stress": 150e6, "elastic_modulus": 210e9, "poisson": 0.3, "density": 7850.0, **material}
    return pin.Scene(GEOMETRY, force, pin.PinMaterial(**values))


def scaled(scene, factor):
    """The same pin, ``factor`` times as large, equally stressed."""
    g = scene.geometry
    sizes = (g.outer_diameter, g.boss_length, g.small_end_length, g.gap)
    return pin.Scene(pin.Geometry(*(factor * s for s in sizes)), scene.force * factor**2, scene.material)


def grams(scene, form=Free(), criterion="tresca_paper", accuracy=1e-10, effects=pin.AUTO, **limits):  # noqa: B008
    outcome = pin.design(
        pin.PinProblem(scene, pin.Limits(**limits), form, pin.CRITERIA[criterion]), effects, accuracy=accuracy
    )
    return None if outcome.value is None else outcome.value.check.mass * 1e3


def program(scene=VAZ, criterion=PAPER, tolerance=1e-9, uniform=0, **limits):
    """A program whose minimum walls are resolved; with ``uniform``, on that many panels per section, without
    adaptation."""
    stations = initial_stations(scene)
    if uniform:
        while stations.x.size < uniform:
            stations = stations.halved(np.ones(stations.left.size, dtype=bool))
        return assemble(scene, pin.Limits(**limits), criterion, Physics(), stations)
    for _ in range(30):
        found = assemble(scene, pin.Limits(**limits), criterion, Physics(), stations)
        doubt = stations.error_estimate(found.lower)
        if doubt.sum() < tolerance:
            return found
        stations = stations.halved(doubt > 0.1 * tolerance / stations.left.size)
    return found


def exact_wall(m, q, digits=50):
    """1 - beta of 1 - beta^4 = sqrt(m^2 + q^2 (1 + beta + beta^2)^2), by bisection in 50 digits."""
    with mp.workdps(digits):
        m, q = mp.mpf(m), mp.mpf(q)

        def short(beta):
            return 1 - beta**4 - mp.sqrt(m * m + (q * (1 + beta + beta * beta)) ** 2)

        low, high = mp.mpf(0), mp.mpf(1)
        for _ in range(4 * digits):
            middle = (low + high) / 2
            low, high = (middle, high) if short(middle) > 0 else (low, middle)
        return 1 - (low + high) / 2


def exact_forces(scene, x, digits=50):
    """Q and M of the pin in the textbook's pieces, not Macaulay's sums, for x up to the middle."""
    g = scene.geometry
    with mp.workdps(digits):
        a, b, d, p, x = (mp.mpf(v) for v in (g.boss_length, g.small_end_length, g.gap, scene.force, x))
        if x <= a:
            return p * x**2 / (2 * a**2), p * x**3 / (6 * a**2)
        moment_at_edge = p * a / 6
        if x <= a + d:
            return p / 2, moment_at_edge + p / 2 * (x - a)
        t = x - a - d
        return p / 2 - p * t / b, moment_at_edge + p / 2 * (x - a) - p * t**2 / (2 * b)


def macaulay_terms(scene):
    """The pin's own load as the paper's Macaulay terms: coefficient, start, order."""
    g, force = scene.geometry, scene.force
    a, b, rod = g.boss_length, g.small_end_length, g.boss_length + g.gap
    ramp, boss, end, far = force / (2.0 * a * a), force / a, rod + b, g.length - a
    rods = (-force / b, rod, 1), (force / b, end, 1)
    return (ramp, 0.0, 2), (-ramp, a, 2), (-boss, a, 1), *rods, (boss, far, 1), (-ramp, far, 2)


def numbers(scene, x, digits=50):
    """m and q of the section equation."""
    with mp.workdps(digits):
        shear, moment = exact_forces(scene, x, digits)
        sigma, d = mp.mpf(scene.material.allowable_stress), mp.mpf(scene.geometry.outer_diameter)
        return 32 * moment / (mp.pi * sigma * d**3), 32 * abs(shear) / (3 * mp.pi * sigma * d**2)


def relative(value, exact):
    return abs(float((mp.mpf(value) - exact) / exact)) if exact else abs(float(value))


def circle(diameter):
    return math.pi * diameter**2 / 4


def flexibility_values(u, law):
    """1/v and phi."""
    none, one = np.zeros_like(u), np.ones_like(u)
    return densities(u, one, none, law), densities(u, none, one, law)
