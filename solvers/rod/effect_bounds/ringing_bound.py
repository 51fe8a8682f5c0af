"""What corners and jumps of the force leave ringing in the strip, bounded before anything is solved.

A mode of the pace omega [1/rad] that the quasi-static motion c(phi) drives rings by int c' exp(i theta) dphi beside it
(``solvers.rod.vibration.ringing``). Every load is once continuously differentiable, so that between two of its own
angles a and b, by parts once and again, less what cancels with the neighbours, that is at most the least of

    int |c'|,   (|c'(a)| + |c'(b)| + int |c''|)/omega,   (|c''(a)| + |c''(b)| + int |c'''|)/omega^2

whether the piece is a jump that the mode cannot follow or a stretch of many of its periods. With no damping the pieces'
shares add up, at worst. Pieces are taken as they are, however narrow: each is sampled at its own five places.

Source: A. Erdelyi, Asymptotic Expansions (1956), section 2.9.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.rod.load.axial_force import Drive, axial_force
from solvers.rod.strip.beam_column import beam_constants

Array = NDArray[np.float64]

_PARTS = 4


def pieces_of(angles: Array) -> Array:
    """Ends [rad] of the pieces between such angles, over one turn from the first to itself; (n + 1,), or empty."""
    if not angles.size:
        return angles
    ends = np.unique(np.mod(angles, TURN))
    return np.append(ends, ends[0] + TURN)


@kernel
def left_ringing(
    drive: Drive, ends: Array, stiffness: float, l: float, rod_length: float, pace: float
) -> tuple[float, float]:
    """Of V''' and V'' at the clamp per unit crank radius [1/m^3, 1/m^2], all pieces added up.

    ``pace`` is the slowest mode's natural frequency over the turning speed, that is in radians a radian.
    """
    shear_sum, clamp_sum = 0.0, 0.0
    shear, clamp = np.empty(_PARTS + 1), np.empty(_PARTS + 1)
    for k in range(ends.size - 1):
        step = (ends[k + 1] - ends[k]) / _PARTS
        for j in range(_PARTS + 1):
            angle = ends[k] + step * j
            c, d, _, _ = beam_constants(axial_force(drive, angle) / stiffness, l, rod_length)
            sine = np.sin(angle)
            shear[j], clamp[j] = d * sine, c * sine
        shear_sum += _of_piece(shear, step * pace)
        clamp_sum += _of_piece(clamp, step * pace)
    return shear_sum, clamp_sum


@kernel
def _of_piece(c: Array, phase: float) -> float:
    """The least of the three, from values ``phase`` radians of the mode apart."""
    first, second, third = c[1:] - c[:-1], np.empty(_PARTS - 1), np.empty(_PARTS - 2)
    for j in range(_PARTS - 1):
        second[j] = first[j + 1] - first[j]
    for j in range(_PARTS - 2):
        third[j] = second[j + 1] - second[j]
    # From the middles of the outermost differences to the ends they go on changing as they did.
    jump, slope, bend = 0.0, 0.5 * (abs(second[0]) + abs(second[-1])), abs(third[0]) + abs(third[-1])
    for x in first:
        jump += abs(x)
    for x in second:
        slope += abs(x)
    for x in third:
        bend += abs(x)
    slope += abs(first[0] - 0.5 * second[0]) + abs(first[-1] + 0.5 * second[-1])
    bend += abs(second[0] - third[0]) + abs(second[-1] + third[-1])
    return min(jump, slope / phase, bend / (phase * phase))
