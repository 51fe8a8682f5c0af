"""Stresses and deflection of one section of the strip over a revolution.

At the section z, with kappa = psi' and the corrections' series added to it,

    sigma+- = N/(b h) +- (E h/2) kappa,     N = P, or P (1 - V'^2/2) + T V' in large displacement

The extremes over the revolution are those of polynomials (``solvers.numerics.panels``), or with superposed ringing
those of both (``solvers.numerics.ripple_peaks``). Without ringing, ``ringing`` is None, and kernels are compiled
without it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.panels import Rule, extremes, greatest, largest
from solvers.numerics.ripple import Ripple, amplitude_bounds
from solvers.numerics.ripple_peaks import greatest_with_ripple
from solvers.rod.cycle.bent_strip import linear_shape, tangential_force
from solvers.rod.cycle.state import FORCE, SIDE, Strip

UPPER, LOWER, DEFLECTION = range(3)
"""Layers: stress of the fibre at +h/2, of the fibre at -h/2, deflection."""
FIBRE_LAYERS, DEFLECTION_LAYERS = (UPPER, LOWER + 1), (DEFLECTION, DEFLECTION + 1)
"""Ranges of layers: first, and one past the last."""
MAXIMUM, MAXIMUM_ERROR, MINIMUM, MINIMUM_ERROR = range(4)
"""Columns of a table of extremes over the revolution: maximum and its error, minimum and its error."""


class Field(NamedTuple):
    """A sampled revolution, evaluable along the strip. SI units; columns are angles, panel by panel.

    edges, rule        the panels
    strip              the strip, with its constants of stress
    states             (state.ROWS, n)
    curvature_series   Legendre series over the strip of the corrections to V'' [1/m], (terms, n)
    deflection_series  the same to V [m]
    inclined           whether N is tangential to the deflected strip
    direct             1/(b h) [1/m^2]; 0 for a constant force
    constant           its stress [Pa], which the fatigue criterion adds: it would mask a small amplitude
    """

    edges: Array
    rule: Rule
    strip: Strip
    states: Array
    curvature_series: Array
    deflection_series: Array
    inclined: bool
    direct: float
    constant: float


class RingingShape(NamedTuple):
    """Ringing superposed on a shape that is smooth between corners: a ripple with several parts, Legendre series over
    the strip of their V'' [1/m] and V [m] (terms, parts), and their T [N] and M0 [N m] (parts,). ``begins`` is the
    number of restarts per revolution."""

    ripple: Ripple
    curvature_series: Array
    deflection_series: Array
    side: Array
    moment: Array
    begins: int


@kernel
def field_of(
    edges: Array, rule: Rule, strip: Strip, states: Array, curvature_series: Array, deflection_series: Array,
    inclined: bool,
) -> Field:  # fmt: skip
    """The field of a sampled revolution."""
    direct, constant = strip.direct, 0.0
    high, low = extremes(states[FORCE])
    if not inclined and high == low:
        direct, constant = 0.0, direct * high
    return Field(edges, rule, strip, states, curvature_series, deflection_series, inclined, direct, constant)


@kernel
def section_layers(field: Field, z: float, out: Array) -> None:
    """Write stresses [Pa] of both fibres and deflection [m] at a section to ``out``, shape (3, n)."""
    states, n = field.states, field.states.shape[1]
    curvature, slope, deflection = out[0], out[1], out[2]
    linear_shape(field.strip, states, z, curvature, slope, deflection)
    zeta = 2.0 * z / field.strip.length - 1.0
    add_series(field.curvature_series, zeta, curvature)
    add_series(field.deflection_series, zeta, deflection)
    for i in range(n):
        tangential = states[FORCE, i]
        if field.inclined:
            tangential = tangential_force(tangential, states[SIDE, i], slope[i])
        direct, bending = field.direct * tangential, field.strip.bending * curvature[i]
        out[0, i], out[1, i] = direct + bending, direct - bending


@kernel
def add_series(series: Array, x: float, out: Array) -> None:
    """Add a Legendre series (terms, n) at x by Bonnet's recursion."""
    previous, legendre = 0.0, 1.0
    for k in range(series.shape[0]):
        for i in range(out.size):
            out[i] += legendre * series[k, i]
        previous, legendre = legendre, ((2 * k + 1) * x * legendre - k * previous) / (k + 1)


@kernel
def _parts_at(series: Array, x: float) -> Array:
    """Values of Legendre series (terms, parts) at x in [-1, 1], (parts,)."""
    polynomials = np.empty(series.shape[0])
    previous, legendre = 0.0, 1.0
    for k in range(polynomials.size):
        polynomials[k] = legendre
        previous, legendre = legendre, ((2 * k + 1) * x * legendre - k * previous) / (k + 1)
    return np.dot(polynomials, series)


@kernel
def extremes_at(
    field: Field, ringing: RingingShape | None, z: float, first: int, last: int, tolerance: float, work: Array,
    out: Array,
) -> None:  # fmt: skip
    """Maximum and minimum over the revolution of the layers ``first`` … ``last`` - 1 at a section.

    ``tolerance`` is relative to the maximum magnitude of the layer. ``work`` has shape (3, n), ``out`` (3, 4).
    """
    section_layers(field, z, work)
    parts, bounds = np.empty(0), np.empty((0, 0))
    for layer in range(first, last):
        target = tolerance * largest(work[layer])
        if ringing is not None:
            if layer == LOWER and first == UPPER:
                # The other fibre's bending stress is the opposite, with the same bounds.
                parts = -parts
            else:
                series = ringing.deflection_series if layer == DEFLECTION else ringing.curvature_series
                parts = _parts_at(series, 2.0 * z / field.strip.length - 1.0)
                if layer != DEFLECTION:
                    parts *= field.strip.bending if layer == UPPER else -field.strip.bending
                bounds = amplitude_bounds(ringing.ripple, parts)
        for side in range(2):
            sign = 1.0 - 2.0 * side
            if ringing is None:
                value, error, _ = greatest(field.edges, field.rule, work[layer], sign, target)
            else:
                value, error, _ = greatest_with_ripple(
                    field.edges, field.rule, work[layer], sign, target, ringing.ripple, parts, bounds
                )
            out[layer, 2 * side], out[layer, 2 * side + 1] = sign * value, error
