"""The part as delivered: the contour of a curved shape and its points, to the accuracy asked for."""

from __future__ import annotations

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.optimum.program import Evaluation, coefficients, constraints_at
from solvers.pin.section.flexibility import densities
from solvers.pin.shapes.contour import RESOLUTION, Contour, contour
from solvers.pin.stations.lobatto_panels import NODE_PLACES, NODES
from solvers.verdict import MAX_SLACK

_FINEST, _ROUNDING = 1e-9, 4e-15
"""Least relative excess tolerated, and relative rounding error of a diameter."""
_SHARE, _NARROW = 0.5, 1e-8
"""Share of the tolerance for walls at the stations; width of panels, relative to the length, below which they are not
refined."""
_GAUSS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)
_SAMPLES = (NODE_PLACES[:-1, None] + 0.5 * np.diff(NODE_PLACES)[:, None] * (1.0 + _GAUSS)).ravel()
_SAMPLE_WEIGHTS = (0.5 * np.diff(NODE_PLACES)[:, None] * _GAUSS_WEIGHTS).ravel()
"""Samples of a panel, three between two nodes, on [-1, 1]."""


def tolerance_of(accuracy: float) -> float:
    """Return the relative excess of the stress tolerated in a contour: half of the slack of verdicts."""
    return max(0.5 * min(accuracy, MAX_SLACK), _FINEST)


def _finest(found: Evaluation) -> float:
    """Return the wall [m] to which diameters are resolved: by choice, and by rounding."""
    thick = found.program.variable.unit_diameter * float(found.walls.max())
    return RESOLUTION * thick + _ROUNDING * (found.program.variable.given + thick)


def contour_of(found: Evaluation, accuracy: float) -> Contour:
    """Return a shape's contour, within half of its tolerance at the stations, not steeper than its limit."""
    program, variable, tolerance = found.program, found.program.variable, tolerance_of(accuracy)
    thick, steepest = variable.unit_diameter * found.walls, program.limits.max_slope
    near = _SHARE * tolerance * thick + _finest(found)
    steepest = np.inf if steepest is None else steepest * (1.0 + 0.5 * _FINEST)
    return contour(program.stations, variable.sizes(found.walls), program.scene.geometry.length, near, steepest)


def contour_excess(found: Evaluation, accuracy: float) -> Array:
    """Return per panel by how much the contour violates a limit between the stations, over the tolerance, (panels,).

    The greatest of: its utilisation over the greatest one at stations, less 1; the least wall over its own, less 1;
    and, if these add up to more than the tolerance, its differences from the stations' mass and deflection, relative to
    the total and times the number of panels.
    """
    program, shape, tolerance = found.program, contour_of(found, accuracy), tolerance_of(accuracy)
    stations, variable, scene = program.stations, program.variable, program.scene
    finest = _finest(found) / variable.unit_diameter
    if not finest < tolerance * found.walls.max():
        # No diameter has the digits of such thin walls.
        return np.zeros_like(stations.width)
    side = np.repeat(0.5 * (stations.left + stations.right), _SAMPLES.size)
    x = side + (0.5 * stations.width[:, None] * _SAMPLES).ravel()
    walls = variable.thickness(shape.at(x, x)) / variable.unit_diameter
    enough = walls + finest
    used = variable.utilisations(constraints_at(scene, program.criterion, x, side), enough)
    peaks = used / np.maximum(found.utilisations.max(axis=1), 1e-300)[:, None]
    excess = np.concatenate([peaks, [program.floor / np.maximum(enough, 1e-300)]]).max(axis=0)
    excess = excess.reshape(-1, _SAMPLES.size).max(axis=1) - 1.0
    u, own = variable.solidity_of(walls), variable.solidity_of(found.walls)
    integrals = [(u, own, program.volume(own))]
    if program.limit is not None:
        bending, shear = coefficients(scene, program.physics, variable, scene.own_forces(x, side))
        integrals.append((densities(u, bending, shear, program.law), found.density, found.deflection))
    for sampled, at_nodes, total in integrals:
        part = 0.5 * stations.width / stations.span * (sampled.reshape(-1, _SAMPLES.size) @ _SAMPLE_WEIGHTS)
        off = np.abs(part - (program.weight * at_nodes).reshape(-1, NODES).sum(axis=1))
        if off.sum() > tolerance * total:
            excess = np.maximum(excess, off * (off.size / max(total, 1e-300)))
    return np.where(stations.width > _NARROW * scene.geometry.length, excess / tolerance, 0.0)
