"""Free vibration of a fast mode under slowly varying stiffness: an exponential whose cost does not depend on the
frequency (WKB).

    M a'' + C a' + (1 + dP(phi) G) a = 0,   a = y(phi) exp(int x dphi),   y_n = 1

gives for the exponential rate x and for the components y_k of the other modes

    mu_n (x^2 + x') + C_n x = -(1 + dP sum_k G_nk y_k),
    y_k (1 + dP G_kk + mu_k (x^2 + x') + C_k x) = -dP sum_(j != k) G_kj y_j - mu_k (y_k'' + 2 x y_k') - C_k y_k'

solved by fixed-point iteration, with the right-hand sides and all derivatives from the previous iterate. Each iteration
reduces the error by about the relative change of the stiffness in a period. If a mode oscillates many times while the
force changes, few iterations suffice, whatever its frequency. A real motion is the real part of a complex multiple.

Source: for one mode, F. J. Agocs, A. H. Barnett, An adaptive spectral method for oscillatory second-order linear ODEs
with frequency-independent cost (2024); without derivatives, G. Green, J. Liouville (both 1837).
"""

from __future__ import annotations

import math

import numpy as np

from solvers.numerics.arrays import Array, Complex
from solvers.numerics.jit import fusing_kernel
from solvers.numerics.radau import Radau


@fusing_kernel
def free_mode(
    n: int,
    widths: Array,
    fluctuation: Array,
    masses: Array,
    damping: Array,
    geometric: Array,
    rule: Radau,
    tolerance: float,
    max_iterations: int,
) -> tuple[Complex, Complex, Complex, Array]:
    """Free vibration of mode n on all elements, from ``fluctuation`` dP (elements, points), the modal masses and G.

    Returns y (elements, points, modes), y' + x y, int x dphi from each element's start (elements, points), and the
    largest error of the latter on each element. Iterations end when x times the element's width changes by no more than
    ``tolerance``.
    """
    count, p = fluctuation.shape
    modes = masses.size
    # Real and imaginary parts of the shape y and, last, the rate x, as rows of real matrices.
    values, first, second = np.zeros((p, 2, modes + 1)), np.zeros((p, 2, modes + 1)), np.zeros((p, 2, modes + 1))
    products, matrix = np.zeros((p, 2, modes + 1)), np.zeros((modes + 1, modes + 1))
    value_rows, product_rows = values.reshape(2 * p, modes + 1), products.reshape(2 * p, modes + 1)
    flat_values, flat_first, flat_second = values.reshape(p, -1), first.reshape(p, -1), second.reshape(p, -1)
    for j in range(modes):
        for k in range(modes):
            matrix[j, k] = geometric[j, k]
    y, rate = np.empty((count, p, modes), np.complex128), np.empty((count, p, modes), np.complex128)
    x, phase, error = np.empty(p, np.complex128), np.zeros((count, p), np.complex128), np.zeros(count)
    decay = 0.5 * damping[n] / masses[n]
    for e in range(count):
        h = widths[e]
        for i in range(p):
            x[i] = 1j * math.sqrt((1.0 + fluctuation[e, i] * geometric[n, n]) / masses[n]) - decay
            for k in range(modes):
                values[i, 0, k], values[i, 1, k] = 1.0 if k == n else 0.0, 0.0
                products[i, 0, k], products[i, 1, k] = geometric[n, k], 0.0
        first[:], second[:], previous = 0.0, 0.0, np.inf
        for iteration in range(max_iterations):
            for i in range(p):
                rate_slope = first[i, 0, modes] + 1j * first[i, 1, modes]
                square, growth, frequency = x[i] * x[i] + rate_slope, x[i].real, x[i].imag
                for k in range(modes):
                    stiffness = fluctuation[e, i] * geometric[k, k]
                    real_slope, imag_slope = first[i, 0, k], first[i, 1, k]
                    real = fluctuation[e, i] * products[i, 0, k] - stiffness * values[i, 0, k] + damping[k] * real_slope
                    imag = fluctuation[e, i] * products[i, 1, k] - stiffness * values[i, 1, k] + damping[k] * imag_slope
                    real += masses[k] * (second[i, 0, k] + 2.0 * (growth * real_slope - frequency * imag_slope))
                    imag += masses[k] * (second[i, 1, k] + 2.0 * (growth * imag_slope + frequency * real_slope))
                    real_stiffness = 1.0 + stiffness + masses[k] * square.real + damping[k] * growth
                    imag_stiffness = masses[k] * square.imag + damping[k] * frequency
                    inverse = -1.0 / (real_stiffness * real_stiffness + imag_stiffness * imag_stiffness)
                    values[i, 0, k] = (real * real_stiffness + imag * imag_stiffness) * inverse
                    values[i, 1, k] = (imag * real_stiffness - real * imag_stiffness) * inverse
                values[i, 0, n], values[i, 1, n] = 1.0, 0.0
            np.dot(value_rows, matrix, product_rows)
            change = 0.0
            for i in range(p):
                coupled = products[i, 0, n] + 1j * products[i, 1, n]
                rate_slope = first[i, 0, modes] + 1j * first[i, 1, modes]
                new = 1j * np.sqrt((1.0 + fluctuation[e, i] * coupled) / masses[n] + rate_slope - decay * decay) - decay
                change = max(change, abs(new - x[i]) * h)
                x[i] = new
                values[i, 0, modes], values[i, 1, modes] = new.real, new.imag
            error[e] = change * min(change / previous, 1.0) if iteration > 1 else change
            np.dot(rule.first, flat_values, flat_first)
            np.dot(rule.second, flat_values, flat_second)
            first /= h
            second /= h * h
            # Derivatives enter in the second iteration.
            if change <= tolerance or (iteration > 1 and change > previous):
                break
            previous = change
        for i in range(p):
            for k in range(modes):
                y[e, i, k] = values[i, 0, k] + 1j * values[i, 1, k]
                rate[e, i, k] = first[i, 0, k] + 1j * first[i, 1, k] + x[i] * y[e, i, k]
            for j in range(p):
                phase[e, i] += h * rule.integral[i, j] * x[j]
    return y, rate, phase, error
