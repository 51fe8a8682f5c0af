"""The frequency ratio of a strip, which tells how close it is to resonance.

    Omega = (1/2 pi) integral of omega_1(P(phi))/omega dphi

is the number of free oscillations of the strip per revolution: the axial force P changes the natural frequency omega_1
slowly compared with the oscillation, whose phase is the integral of omega_1 (WKB approximation). At an integer Omega
the oscillation repeats itself in phase with the load of every revolution: the strip is resonant. The square of omega_1
is a nearly linear function of P, so that it is interpolated between few forces.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import grid
from solvers.rod.cycle.composition import Cycle
from solvers.rod.optimum.full_model.strip import FullStrip, dimensions_of, logarithms
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.strip.stiffness import bending_stiffness
from solvers.rod.vibration.natural_frequencies import FEW_POLYNOMIALS, Polynomials, all_polynomials, frequency_under

_ANGLES = grid(128)
"""Crank angles [rad] at which the axial force is sampled for its mean and minimum."""
_STEP = 1e-4
"""Step of the differences of ln Omega, in ln b, ln h, ln l."""


def is_stable(cycle: Cycle) -> bool:
    """Whether a strip does not buckle."""
    return -float(np.min(cycle.axial_force(_ANGLES))) < min(FullStrip(cycle).critical)


def log_frequency_ratio(cycle: Cycle) -> float:
    """ln Omega of a strip."""
    return _log_ratio(cycle.scene, cycle.dimensions, cycle.axial_force(_ANGLES))


def log_frequency_ratio_gradient(cycle: Cycle) -> Array:
    """Derivatives of ln Omega with respect to ln(b, h, l) at the same axial force, (3,)."""
    scene, x, forces = cycle.scene, logarithms(cycle.dimensions), cycle.axial_force(_ANGLES)
    points = [x, *(x - _STEP * unit for unit in np.eye(3))]
    values = [_log_ratio(scene, dimensions_of(point, scene), forces) for point in points]
    return (values[0] - np.array(values[1:])) / _STEP


def _log_ratio(scene: Scene, d: Dimensions, forces: Array) -> float:
    line_mass = scene.material.density * d.b * d.h
    stiffness, length = bending_stiffness(scene, d), scene.mechanism.rod_length
    mean = _mean_frequency(all_polynomials(), stiffness, line_mass, d.l, length, np.ascontiguousarray(forces))
    return math.log(mean / scene.mechanism.speed)


@kernel
def _mean_frequency(
    table: Polynomials, stiffness: float, line_mass: float, length: float, rod_length: float, forces: Array
) -> float:
    """Mean of the first natural frequency [Hz] over axial forces [N] (angles,), from EI [N m^2], rho A [kg/m], l and L
    [m]. Its square is interpolated by a parabola through the least, the middle and the greatest force; where the strip
    buckles it is zero."""
    low, high = np.min(forces), np.max(forces)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    squares = np.empty(3)
    for k in range(3):
        force = middle + (k - 1) * half
        squares[k] = frequency_under(table, stiffness, line_mass, length, rod_length, force, FEW_POLYNOMIALS) ** 2
    slope, curvature = 0.5 * (squares[2] - squares[0]), squares[2] - 2.0 * squares[1] + squares[0]
    total = 0.0
    for force in forces:
        x = (force - middle) / half if half > 0.0 else 0.0
        total += math.sqrt(max(squares[1] + x * (slope + 0.5 * x * curvature), 0.0))
    return total / forces.size
