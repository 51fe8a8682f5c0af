"""Closed-form check of stepped-bore pins under the rod force: one compiled loop over any number of pins.

The wall is constant within a step, so the utilisation is greatest at an end of the step or of a piece: before the
small end neither M nor Q decreases; within it d/dt (A M^2 + B Q^2) = 2 Q (A M - B P/b), whose second factor increases
with M, so that there is no interior maximum. The deflection of the middle relative to the inner edges of the bosses,

    2 integral from a to L/2 of  M m/(E I0 v) + Q phi/(2 G A0),   m = (x - a)/2,

has cubic integrands, which two-point Gauss quadrature integrates exactly.

The forces are those of ``solvers.pin.load.piston_pin``. Source: the paper's equations (4) to (8).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.parallel import in_slices
from solvers.pin.load.piston_pin import forces_in_piece
from solvers.pin.scene import PinMaterial
from solvers.pin.section.criteria import Criterion
from solvers.pin.section.flexibility import cowper

_MAX_CONSTRAINTS = 3
_GAUSS = 0.5 / math.sqrt(3.0)
_TIE_TOLERANCE = 1.0 + 1e-14
"""Relative tie tolerance: of equally utilised positions the first one is reported."""


class Pins(NamedTuple):
    """Input data of n pins, SI units.

    ``sizes`` (n, 5): D, a, b, delta, P. ``elastic`` (n, 4): E, G, and Cowper's A and B (0 without shear).
    ``constraints`` (n, 3, 3), one row per strength constraint, zero-padded: the factors of bending stress and shear
    stress [1/Pa], and 1 for the criterion or 0 for the separate shear allowable. ``laws`` (n, 3): c0, c1, c2 of the
    maximum shear stress Q (c0 + c1 w + c2 w^2)/(D^2 v).
    """

    sizes: Array
    elastic: Array
    constraints: Array
    laws: Array


class Results(NamedTuple):
    """Results of n pins, (n,) each.

    Volume relative to the solid pin, deflection [m], maximum utilisation of the criterion and of the shear
    allowable, position of the former [m], maximum moment [N m] and shear [N], and the maximum utilisation of the solid
    pin.
    """

    volume: Array
    deflection: Array
    criterion: Array
    shear: Array
    worst: Array
    moment: Array
    force: Array
    solid: Array


@kernel
def _utilisations(
    moment: float, force: float, wall: float, d: float, constraints: Array, law: Array
) -> tuple[float, float]:
    """Return the utilisation of the criterion and of the shear allowable, F(w)/v(w); inf without a wall, 0 unloaded."""
    v = wall * (2.0 - wall) * (2.0 - 2.0 * wall + wall * wall)
    across = (law[0] + wall * (law[1] + wall * law[2])) / (d * d)
    along = 32.0 / (math.pi * d * d * d)
    criterion, shear = 0.0, 0.0
    for k in range(constraints.shape[0]):
        f = math.hypot(constraints[k, 0] * along * moment, constraints[k, 1] * across * force)
        if f > 0.0:
            utilisation = f / v if v > 0.0 else math.inf
            if constraints[k, 2] == 1.0:
                criterion = max(criterion, utilisation)
            else:
                shear = max(shear, utilisation)
    return criterion, shear


@kernel
def evaluate(pins: Pins, ends: Array, walls: Array, out: Results) -> None:
    """Evaluate stepped-bore pins; write the results into ``out``.

    ``ends`` (n, k): non-decreasing end positions of the steps of the first half [m], the last at or beyond the
    middle; ``walls`` (n, k): relative walls 1 - d/D in [0, 1].
    """
    for i in range(walls.shape[0]):
        d, a, b, gap, p = pins.sizes[i]
        modulus, shear_modulus, law_a, law_b = pins.elastic[i]
        constraints, law = pins.constraints[i], pins.laws[i]
        bend_unit = 1.0 / (modulus * math.pi * d**4 / 64.0)
        shear_unit = 1.0 / (shear_modulus * 0.25 * math.pi * d * d)
        rod = a + gap
        half = rod + 0.5 * b
        volume, bent, sheared, begin = 0.0, 0.0, 0.0, 0.0
        criterion, shear, worst, solid = 0.0, 0.0, 0.0, 0.0
        for j in range(walls.shape[1]):
            final = j == walls.shape[1] - 1 or ends[i, j] >= half
            end = half if final else ends[i, j]
            wall = walls[i, j]
            u = wall * (2.0 - wall)
            volume += (end - begin) / half * u
            bending_integral, shear_integral = 0.0, 0.0
            for piece in range(3):
                start = 0.0 if piece == 0 else (a if piece == 1 else rod)
                length = a if piece == 0 else (gap if piece == 1 else 0.5 * b)
                low = min(max(begin - start, 0.0), length)
                high = length if final else min(max(end - start, 0.0), length)
                if high <= low:
                    continue
                for side in range(2):
                    t = low if side == 0 else high
                    moment, force = forces_in_piece(piece, t, a, b, gap, p)
                    one, other = _utilisations(moment, force, wall, d, constraints, law)
                    full, full_shear = _utilisations(moment, force, 1.0, d, constraints, law)
                    solid, shear = max(solid, full, full_shear), max(shear, other)
                    if one > criterion * _TIE_TOLERANCE:
                        criterion, worst = one, start + t
                if piece > 0:
                    arm = 0.0 if piece == 1 else gap
                    middle, width = 0.5 * (low + high), high - low
                    for side in range(2):
                        t = middle + (_GAUSS if side == 1 else -_GAUSS) * width
                        moment, force = forces_in_piece(piece, t, a, b, gap, p)
                        bending_integral += 0.5 * width * moment * 0.5 * (arm + t)
                        shear_integral += 0.5 * width * force * 0.5
            if bending_integral > 0.0:
                bent += bending_integral / (u * (2.0 - u)) if u > 0.0 else math.inf
            if shear_integral > 0.0 and law_a > 0.0:
                c = 2.0 - u
                sheared += shear_integral * (law_a / u + law_b * (1.0 - u) / (u * c * c)) if u > 0.0 else math.inf
            begin = end
            if final:
                break
        out.volume[i], out.criterion[i], out.shear[i], out.worst[i] = volume, criterion, shear, worst
        out.deflection[i] = 2.0 * (bent * bend_unit + sheared * shear_unit)
        out.moment[i], out.force[i] = forces_in_piece(2, 0.5 * b, a, b, gap, p)[0], 0.5 * p
        out.solid[i] = solid


def material_rows(criterion: Criterion, material: PinMaterial, shear_deflection: bool) -> tuple[Array, Array, Array]:
    """Return a pin's rows of ``elastic``, ``constraints`` and ``laws`` in ``Pins``."""
    law, shears = cowper(material.poisson), float(shear_deflection)
    elastic = np.array([material.elastic_modulus, material.shear_modulus, shears * law.a, shears * law.b])
    constraints = np.zeros((_MAX_CONSTRAINTS, 3))
    for row, factors in zip(constraints, criterion.factors, strict=False):
        row[:] = factors.bending / material.allowable_stress, factors.shear / material.allowable_stress, 1.0
    if material.allowable_shear is not None:
        constraints[-1] = 0.0, 1.0 / material.allowable_shear, 0.0
    return elastic, constraints, np.array(criterion.law(material))


def evaluated(pins: Pins, ends: Array, walls: Array, threads: int = 1) -> Results:
    """Run ``evaluate`` on all pins, divided into one slice per thread."""
    count = walls.shape[0]
    out = Results(*(np.empty(count) for _ in Results._fields))

    def solve(part: slice) -> None:
        evaluate(Pins(*(a[part] for a in pins)), ends[part], walls[part], Results(*(a[part] for a in out)))

    in_slices(solve, count, threads)
    return out
