"""The strip's equation of motion in its modes under the mean axial force.

With g the static shape per unit stroke s under the mean force, V = s g + sum_n a_n psi_n in the modes, which have unit
stiffness and masses mu_n, so that with G the geometric stiffness and swing = P - mean

    M a'' + C (a - c)' + (1 + swing G) a = f = (1 + swing G) c + s b,   b_n = int rho A omega^2 psi_n g dz

where c holds the quasi-static shape, and C = eta M^(1/2) is modal damping by the loss factor eta = 2 zeta: a mode by
itself reaches 1/eta times its static amplitude at resonance. It acts on d = a - c, what inertia adds; so a slow strip
is the quasi-static one whatever eta is. Without shear c follows from its weak form,
(1 + swing G) c = -s swing h with h_n = int g' psi_n' dz + e g'(l) psi_n'(l), diagonal in coordinates of G's own. With
shear (``solvers.rod.strip.shear``) V = W/m - gamma D z, W = int psi dz, where W obeys the same equation under
P_s = EI q_s, with the stroke W(l) + e W'(l) and the moment EI (W'' + e W''') at the pin.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.numerics.jit import kernel
from solvers.rod.cycle.state import CLAMP, COUPLING, FORCE, HEAD, SHEAR, SOFTENING, STROKE, Strip, constants
from solvers.rod.strip.shape import bend
from solvers.rod.vibration.natural_frequencies import (
    Polynomials,
    StripBasis,
    combined,
    energies,
    pinned,
    polynomials_of,
)

Array = NDArray[np.float64]

SOFTEST = 0.1
"""Of a mode's stiffness: no frequency is taken for lower than under that."""


class StripEquation(NamedTuple):
    """The equation of one strip.

    ``mean`` is the mean axial force [N] as far as it bends the strip, ``loss`` eta, ``slowness`` holds mu_n [rad^2],
    the greatest first; ``modes`` takes amplitudes of the modes to those of the basis; ``coupling`` is G [1/N], with
    eigenvalues ``rates`` and, in columns, eigenvectors ``turned``; ``stretched`` is h, ``carried`` b [1/m] and
    ``clamp`` V'' and V''' of the modes at the clamp, (2, modes); ``tip`` EI psi_n'(l) and ``leaning`` int rho A omega^2
    psi_n z dz, of which shear makes use; ``last`` (2, 4) are V'' and V''' at the clamp of the last four polynomials,
    for unit amplitudes of the basis.
    """

    strip: Strip
    basis: StripBasis
    mean: float
    loss: float
    slowness: Array
    modes: Array
    coupling: Array
    rates: Array
    turned: Array
    stretched: Array
    carried: Array
    clamp: Array
    tip: Array
    leaning: Array
    last: Array

    @staticmethod
    def of(strip: Strip, inertia: float, mean: float, polynomials: int, loss: float) -> StripEquation:
        """For rho A omega^2 = ``inertia`` [N/m^2] and the mean force [N]. Raises InvalidInput where that buckles it."""
        found = _equation(strip, inertia, mean, float(loss), polynomials_of(polynomials))
        if not found.slowness.size:
            raise InvalidInput("dimensions.h", "the strip buckles under the mean force of the cycle", "thicker")
        return found

    @property
    def pace(self) -> Array:
        """The modes' natural frequencies under the mean force [1/rad], the slowest first."""
        return 1.0 / np.sqrt(self.slowness)

    @property
    def damping(self) -> Array:
        """C of every mode [rad]."""
        return self.loss * np.sqrt(self.slowness)

    def fastest(self, modes: int, swing: Array) -> Array:
        """Natural frequency [1/rad] of the last of so many modes by itself, under forces beside the mean."""
        last = modes - 1
        return np.sqrt(np.maximum(1.0 + swing * self.coupling[last, last], SOFTEST) / self.slowness[last])


@kernel
def _equation(strip: Strip, inertia: float, mean: float, loss: float, table: Polynomials) -> StripEquation:
    """``StripEquation.of``; without modes where the mean force buckles the strip."""
    n, l, points = table.end.size - 1, strip.length, table.zeta.size
    lever, mean = strip.rod_length / l - 1.0, mean * strip.couples
    blend, combination = pinned(table, lever), np.zeros((n + 1, n))
    combination[0, 0], combination[1, 0] = blend
    for j in range(1, n):
        combination[j + 1, j] = 1.0
    mass, geometric, tip = energies(table, lever, n)
    bent, lower, rows = np.empty((2, n)), np.zeros((n, n)), np.empty((n, n))
    for k in range(2):
        combined(table.clamp[k], blend, bent[k])
        for j in range(n):
            bent[k, j] /= l ** (k + 2)
    for i in range(n):
        for j in range(n):
            mass[i, j] *= inertia * l
            geometric[i, j] /= l
    stands = True
    for i in range(n):
        for j in range(i + 1):
            total = mean * geometric[i, j] + (strip.stiffness / l**3 if i == j else 0.0)
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            stands = stands and (i > j or total > 0.0)
            lower[i, j] = total / lower[j, j] if i > j else math.sqrt(max(total, 0.0))
    count = n if stands else 0
    modes, slowness = np.empty((n, count)), np.empty(count)
    if stands:
        for _ in range(2):
            # L^-1 mass, and with that transposed L^-1 mass L^-T
            for i in range(n):
                for j in range(n):
                    total = mass[i, j]
                    for k in range(i):
                        total -= lower[i, k] * rows[k, j]
                    rows[i, j] = total / lower[i, i]
            for i in range(n):
                for j in range(n):
                    mass[i, j] = rows[j, i]
        for i in range(n):
            for j in range(i):
                mass[i, j] = mass[j, i] = 0.5 * (mass[i, j] + mass[j, i])
        masses, vectors = np.linalg.eigh(mass)
        # The greatest masses are known best, and they come first.
        for m in range(n):
            slowness[m] = masses[n - 1 - m]
            for i in range(n - 1, -1, -1):
                total = vectors[i, n - 1 - m]
                for k in range(i + 1, n):
                    total -= lower[k, i] * modes[k, m]
                modes[i, m] = total / lower[i, i]
    # (h, b, leaning, tip) of the basis, weighed with the static shape under the mean force
    coupling = mean / strip.stiffness
    _, _, clamp, shear, head = constants(coupling, l, strip.rod_length, 0.0)
    one = np.array([[coupling], [clamp], [shear], [head]])
    unused, slope, value, read, loads = np.empty(1), np.empty(1), np.empty(1), np.zeros((3, n + 1)), np.empty((4, n))
    for i in range(points + 1):
        zeta = table.zeta[i] if i < points else 1.0
        bend(one[0], one[1], one[2], one[3], l, l * zeta, unused, slope, value)
        for j in range(n + 1):
            if i == points:
                read[0, j] += lever * slope[0] * table.tip[j]
            else:
                weight = table.weights[i]
                read[0, j] += weight * slope[0] * table.slopes[i, j]
                read[1, j] += inertia * l * weight * value[0] * table.values[i, j]
                read[2, j] += inertia * l * weight * l * zeta * table.values[i, j]
    for k in range(3):
        combined(read[k], blend, loads[k])
    for j in range(n):
        loads[0, j] *= strip.couples
        loads[3, j] = strip.stiffness * tip[j] / l
    last = np.empty((2, 4))
    for k in range(2):
        for t in range(4):
            j = n - 3 + t
            last[k, t] = table.clamp[k, j] / l ** (k + 2) * combination[j, max(j - 1, 0)]
    own = np.dot(modes.T, np.dot(geometric, modes))
    for i in range(count):
        for j in range(count):
            own[i, j] *= strip.couples
    rates, turned = np.linalg.eigh(own) if stands else (slowness, own)
    found = np.dot(loads, modes)
    return StripEquation(
        strip, StripBasis(l, combination), mean, loss, slowness, modes, own, rates, np.ascontiguousarray(turned),
        found[0], found[1], np.dot(bent, modes), found[3], found[2], last,
    )  # fmt: skip


@kernel
def quasi_static(equation: StripEquation, states: Array) -> tuple[Array, Array, Array]:
    """P - mean (angles,), c and f (angles, modes) of a table of states (rows, angles)."""
    strip, n, angles = equation.strip, equation.slowness.size, states.shape[1]
    l, lever, sheared = strip.length, strip.rod_length - strip.length, strip.compliance != 0.0
    swing, part, ends, turned = np.empty(angles), np.empty((angles, n)), np.empty((3, angles)), equation.turned
    if sheared:
        # psi', psi and int psi dz at the strip's end
        bend(states[COUPLING], states[CLAMP], states[SHEAR], states[HEAD], l, l, ends[0], ends[1], ends[2])
    # h and EI psi'(l) in coordinates that make G diagonal
    stretched, tip = np.dot(equation.stretched, turned), np.dot(equation.tip, turned)
    for i in range(angles):
        swing[i], stroke, softening = strip.couples * states[FORCE, i] - equation.mean, states[STROKE, i], 1.0
        moment, under, lifted = 0.0, swing[i], stroke
        if sheared:
            softening = states[SOFTENING, i]
            under = strip.stiffness * states[COUPLING, i] - equation.mean
            lifted = ends[2, i] + lever * ends[1, i]
            moment = ends[0, i] + lever * (states[COUPLING, i] * ends[1, i] + states[SHEAR, i])
        for k in range(n):
            load = moment * tip[k] - lifted * under * stretched[k]
            part[i, k] = load / ((1.0 + under * equation.rates[k]) * softening)
    still = np.dot(part, turned.T)
    if sheared:
        for i in range(angles):
            drawn = (ends[2, i] + lever * ends[1, i]) / states[SOFTENING, i] - states[STROKE, i]
            leant = strip.compliance * states[SHEAR, i]
            for a in range(n):
                beside = drawn * equation.carried[a] - leant * equation.leaning[a]
                still[i, a] += beside / equation.slowness[a]
    right = np.dot(still, equation.coupling)
    for i in range(angles):
        for a in range(n):
            right[i, a] = still[i, a] + swing[i] * right[i, a] + states[STROKE, i] * equation.carried[a]
    return swing, still, right
