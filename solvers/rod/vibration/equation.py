"""The strip's equation of motion in its modes under the mean axial force.

The deflection is V = s u + sum_n a_n psi_n with u the static shape per unit lateral displacement s under the mean force
P_m. The modes psi_n are scaled to unit stiffness and have the masses mu_n. With the geometric stiffness matrix G and
the fluctuation dP = P - P_m of the force,

    M a'' + C (a - c)' + (1 + dP G) a = f = (1 + dP G) c + s f0,   f0_n = int rho A omega^2 psi_n u dz

where c is the quasi-static solution and C = eta M^(1/2) is modal damping with the loss factor eta = 2 zeta: an
uncoupled mode reaches 1/eta times its static amplitude at resonance. Damping acts on d = a - c, the dynamic part of the
motion, so that the limit of a slow machine is the quasi-static strip for any eta. Without shear c follows from its weak
form, (1 + dP G) c = -s dP h with h_n = int u' psi_n' dz + e u'(l) psi_n'(l), which is diagonal in the eigenvectors of
G. With shear (``solvers.rod.strip.shear``) V = W/m - g D z, W = int psi dz, where W obeys the same equation under
P_s = EI q_s, with the lateral displacement W(l) + e W'(l) and the moment EI (W'' + e W''') at the pin.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.errors import InvalidInput
from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.cycle.state import COUPLING, FORCE, LATERAL, SHEAR, SOFTENING, Strip, bend_states
from solvers.rod.strip.beam_column import constants
from solvers.rod.strip.shape import bend
from solvers.rod.vibration.natural_frequencies import (
    Polynomials,
    StripBasis,
    combine,
    energy_matrices,
    pin_combination,
    polynomials_of,
)

SOFTEST = 0.1
"""Smallest stiffness of a mode, relative to that under the mean force, for which its frequency is estimated."""


class StripEquation(NamedTuple):
    """Coefficients of the equation of motion of one strip, with n modes.

    mean            mean axial force [N] as far as it bends the strip (0 in plain bending)
    loss            loss factor eta
    masses          modal masses mu_n [rad^2], largest first (n,); their inverses are the squared frequencies
    modes           columns: the modes in amplitudes of the basis (n, n)
    geometric       geometric stiffness G [1/N], (n, n), with its ``eigenvalues`` and ``eigenvectors`` (columns)
    geometric_load  h, (n,)
    inertial_load   f0 [1/m], (n,)
    clamp           V'' and V''' of the modes at the clamp (2, n)
    tip_slopes      EI psi_n'(l), (n,); with shear only
    rotation_load   int rho A omega^2 psi_n z dz, (n,); with shear only
    last_terms      V'' and V''' at the clamp of the last four polynomials for unit amplitudes of the basis (2, 4)
    """

    strip: Strip
    basis: StripBasis
    mean: float
    loss: float
    masses: Array
    modes: Array
    geometric: Array
    eigenvalues: Array
    eigenvectors: Array
    geometric_load: Array
    inertial_load: Array
    clamp: Array
    tip_slopes: Array
    rotation_load: Array
    last_terms: Array

    @staticmethod
    def of(strip: Strip, inertia: float, mean: float, polynomials: int, loss: float) -> StripEquation:
        """Build the equation for rho A omega^2 = ``inertia`` [N/m^2] and the mean force [N].

        Raises InvalidInput if the mean force buckles the strip.
        """
        found = _equation(strip, inertia, mean, float(loss), polynomials_of(polynomials))
        if not found.masses.size:
            raise InvalidInput("dimensions.h", "the strip buckles under the mean force of the cycle", "thicker")
        return found

    @property
    def frequencies(self) -> Array:
        """Natural frequencies under the mean force [1/rad], lowest first."""
        return 1.0 / np.sqrt(self.masses)

    def frequency_of(self, modes: int, fluctuation: Array) -> Array:
        """Natural frequency [1/rad] of mode number ``modes``, uncoupled, for fluctuations P - P_m of the axial force
        [N]."""
        mode = modes - 1
        return np.sqrt(np.maximum(1.0 + fluctuation * self.geometric[mode, mode], SOFTEST) / self.masses[mode])


@kernel
def damping_of(equation: StripEquation) -> Array:
    """Diagonal of C [rad], (n,)."""
    return equation.loss * np.sqrt(equation.masses)


@kernel
def _equation(strip: Strip, inertia: float, mean: float, loss: float, table: Polynomials) -> StripEquation:
    """Kernel of ``StripEquation.of``; returns no modes if the mean force buckles the strip."""
    n, l, points = table.end.size - 1, strip.length, table.zeta.size
    head_ratio, mean = strip.rod_length / l - 1.0, mean * strip.couples
    blend, combination = pin_combination(table, head_ratio), np.zeros((n + 1, n))
    combination[0, 0], combination[1, 0] = blend
    for j in range(1, n):
        combination[j + 1, j] = 1.0
    mass, geometric, tip = energy_matrices(table, head_ratio, n)
    clamp_rows = np.empty((2, n))
    for k in range(2):
        combine(table.clamp[k], blend, clamp_rows[k])
        for j in range(n):
            clamp_rows[k, j] /= l ** (k + 2)
    # The stiffness is diagonal in the eigenvectors of the geometric part: EI/l^3 + P_m/l times its eigenvalues.
    stiffness, root = np.linalg.eigh(geometric)
    for j in range(n):
        stiffness[j] = strip.stiffness / l**3 + mean / l * stiffness[j]
    is_stable = stiffness.min() > 0.0
    count = n if is_stable else 0
    modes, masses = np.empty((n, count)), np.empty(count)
    if is_stable:
        for i in range(n):
            for j in range(n):
                root[i, j] /= math.sqrt(stiffness[j])
        inverse_squares, vectors = np.linalg.eigh(inertia * l * np.dot(root.T, np.dot(mass, root)))
        # The largest eigenvalues are the most accurate; they come first.
        masses[:] = inverse_squares[::-1]
        modes[:] = np.dot(root, vectors)[:, ::-1]
    for i in range(n):
        for j in range(n):
            geometric[i, j] /= l
    # h, f0, rotation load and tip slopes for the basis, by quadrature with the static shape under the mean force
    mean_coupling = mean / strip.stiffness
    _, _, clamp, shear, head = constants(mean_coupling, l, strip.rod_length, 0.0)
    mean_state = np.array([[mean_coupling], [clamp], [shear], [head]])
    second, slope, value, products = np.empty(1), np.empty(1), np.empty(1), np.zeros((3, n + 1))
    loads = np.empty((4, n))
    for i in range(points + 1):
        zeta = table.zeta[i] if i < points else 1.0
        bend(mean_state[0], mean_state[1], mean_state[2], mean_state[3], l, l * zeta, second, slope, value)
        for j in range(n + 1):
            if i == points:
                products[0, j] += head_ratio * slope[0] * table.tip[j]
            else:
                weight = table.weights[i]
                products[0, j] += weight * slope[0] * table.slopes[i, j]
                products[1, j] += inertia * l * weight * value[0] * table.values[i, j]
                products[2, j] += inertia * l * weight * l * zeta * table.values[i, j]
    for k in range(3):
        combine(products[k], blend, loads[k])
    for j in range(n):
        loads[0, j] *= strip.couples
        loads[3, j] = strip.stiffness * tip[j] / l
    last = np.empty((2, 4))
    for k in range(2):
        for t in range(4):
            j = n - 3 + t
            last[k, t] = table.clamp[k, j] / l ** (k + 2) * combination[j, max(j - 1, 0)]
    projected = np.dot(modes.T, np.dot(geometric, modes))
    for i in range(count):
        for j in range(count):
            projected[i, j] *= strip.couples
    eigenvalues, eigenvectors = np.linalg.eigh(projected) if is_stable else (masses, projected)
    modal = np.dot(loads, modes)
    return StripEquation(
        strip, StripBasis(l, combination), mean, loss, masses, modes, projected, eigenvalues,
        np.ascontiguousarray(eigenvectors), modal[0], modal[1], np.dot(clamp_rows, modes), modal[3], modal[2], last,
    )  # fmt: skip


@kernel
def quasi_static(equation: StripEquation, states: Array) -> tuple[Array, Array, Array]:
    """P - P_m [N], (angles,), and c and f (angles, modes), from a table of states (rows, angles)."""
    strip, n, angles = equation.strip, equation.masses.size, states.shape[1]
    l, head_length, shears = strip.length, strip.rod_length - strip.length, strip.compliance != 0.0
    fluctuation, projected, tip = np.empty(angles), np.empty((angles, n)), np.empty((3, angles))
    eigenvectors = equation.eigenvectors
    if shears:
        # psi', psi and int psi dz at the strip's end
        bend_states(states, l, l, tip[0], tip[1], tip[2])
    # h and EI psi'(l) in the eigenvectors of G
    geometric_load, tip_slope = np.dot(equation.geometric_load, eigenvectors), np.dot(equation.tip_slopes, eigenvectors)
    for i in range(angles):
        fluctuation[i], lateral, softening = strip.couples * states[FORCE, i] - equation.mean, states[LATERAL, i], 1.0
        moment, effective, end_lateral = 0.0, fluctuation[i], lateral
        if shears:
            softening = states[SOFTENING, i]
            effective = strip.stiffness * states[COUPLING, i] - equation.mean
            end_lateral = tip[2, i] + head_length * tip[1, i]
            moment = tip[0, i] + head_length * (states[COUPLING, i] * tip[1, i] + states[SHEAR, i])
        for k in range(n):
            load = moment * tip_slope[k] - end_lateral * effective * geometric_load[k]
            projected[i, k] = load / ((1.0 + effective * equation.eigenvalues[k]) * softening)
    static = np.dot(projected, eigenvectors.T)
    if shears:
        for i in range(angles):
            missing_lateral = (tip[2, i] + head_length * tip[1, i]) / states[SOFTENING, i] - states[LATERAL, i]
            shear_rotation = strip.compliance * states[SHEAR, i]
            for a in range(n):
                load = missing_lateral * equation.inertial_load[a] - shear_rotation * equation.rotation_load[a]
                static[i, a] += load / equation.masses[a]
    forces = np.dot(static, equation.geometric)
    for i in range(angles):
        for a in range(n):
            forces[i, a] = static[i, a] + fluctuation[i] * forces[i, a] + states[LATERAL, i] * equation.inertial_load[a]
    return fluctuation, static, forces
