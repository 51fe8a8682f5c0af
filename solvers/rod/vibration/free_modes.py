"""A fast mode that rings freely while the stiffness changes slowly: an exponential, without following its periods.

    M a'' + C a' + (1 + swing(phi) G) a = 0,   a = y(phi) exp(int x dphi),   y_n = 1

leaves for the rate x and for what the other modes do in step with mode n

    mu_n (x^2 + x') + C_n x = -(1 + swing sum_k G_nk y_k),
    y_k (1 + swing G_kk + mu_k (x^2 + x') + C_k x) = -swing sum_(j != k) G_kj y_j - mu_k (y_k'' + 2 x y_k') - C_k y_k'

which are solved again and again with the derivatives, and for y_k the y_j, of the time before: every time better by
about the share by which the stiffness changes in a period. Where a mode rings many times while the force changes, few
times are enough, whatever its frequency; a real motion is the real part of a complex multiple.

Source: for one mode, F. J. Agocs, A. H. Barnett, An adaptive spectral method for oscillatory second-order linear ODEs
with frequency-independent cost (2024); without derivatives, G. Green, J. Liouville (both 1837).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import fusing_kernel
from solvers.numerics.radau import Radau

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@fusing_kernel
def free_mode(
    n: int,
    widths: Array,
    swing: Array,
    slowness: Array,
    damping: Array,
    coupling: Array,
    rule: Radau,
    wanted: float,
    most: int,
) -> tuple[Complex, Complex, Complex, Array]:
    """y (elements, points, modes) and y' + x y, int x dphi from each element's first end (elements, points), and the
    greatest error of the latter on each, from ``swing`` (elements, points) and the masses and G of the modes."""
    count, p = swing.shape
    modes = slowness.size
    # Real and imaginary parts one behind the other, of the shape y and, last, the rate x: what real matrices act on.
    parts, once, twice = np.zeros((p, 2, modes + 1)), np.zeros((p, 2, modes + 1)), np.zeros((p, 2, modes + 1))
    pulled, pulls = np.zeros((p, 2, modes + 1)), np.zeros((modes + 1, modes + 1))
    rows, pulled_rows = parts.reshape(2 * p, modes + 1), pulled.reshape(2 * p, modes + 1)
    flat, flat_once, flat_twice = parts.reshape(p, -1), once.reshape(p, -1), twice.reshape(p, -1)
    for j in range(modes):
        for k in range(modes):
            pulls[j, k] = coupling[j, k]
    y, rate = np.empty((count, p, modes), np.complex128), np.empty((count, p, modes), np.complex128)
    x, phase, error = np.empty(p, np.complex128), np.zeros((count, p), np.complex128), np.zeros(count)
    decay = 0.5 * damping[n] / slowness[n]
    for e in range(count):
        h = widths[e]
        for i in range(p):
            x[i] = 1j * math.sqrt((1.0 + swing[e, i] * coupling[n, n]) / slowness[n]) - decay
            for k in range(modes):
                parts[i, 0, k], parts[i, 1, k] = 1.0 if k == n else 0.0, 0.0
                pulled[i, 0, k], pulled[i, 1, k] = coupling[n, k], 0.0
        once[:], twice[:], last = 0.0, 0.0, np.inf
        for time in range(most):
            for i in range(p):
                steep = once[i, 0, modes] + 1j * once[i, 1, modes]
                bent, to, turn = x[i] * x[i] + steep, x[i].real, x[i].imag
                for k in range(modes):
                    own = swing[e, i] * coupling[k, k]
                    slope, slanted = once[i, 0, k], once[i, 1, k]
                    real = swing[e, i] * pulled[i, 0, k] - own * parts[i, 0, k] + damping[k] * slope
                    imag = swing[e, i] * pulled[i, 1, k] - own * parts[i, 1, k] + damping[k] * slanted
                    real += slowness[k] * (twice[i, 0, k] + 2.0 * (to * slope - turn * slanted))
                    imag += slowness[k] * (twice[i, 1, k] + 2.0 * (to * slanted + turn * slope))
                    held = 1.0 + own + slowness[k] * bent.real + damping[k] * to
                    lost = slowness[k] * bent.imag + damping[k] * turn
                    inverse = -1.0 / (held * held + lost * lost)
                    parts[i, 0, k] = (real * held + imag * lost) * inverse
                    parts[i, 1, k] = (imag * held - real * lost) * inverse
                parts[i, 0, n], parts[i, 1, n] = 1.0, 0.0
            np.dot(rows, pulls, pulled_rows)
            change = 0.0
            for i in range(p):
                total = pulled[i, 0, n] + 1j * pulled[i, 1, n]
                steep = once[i, 0, modes] + 1j * once[i, 1, modes]
                found = 1j * np.sqrt((1.0 + swing[e, i] * total) / slowness[n] + steep - decay * decay) - decay
                change = max(change, abs(found - x[i]) * h)
                x[i] = found
                parts[i, 0, modes], parts[i, 1, modes] = found.real, found.imag
            error[e] = change * min(change / last, 1.0) if time > 1 else change
            np.dot(rule.first, flat, flat_once)
            np.dot(rule.second, flat, flat_twice)
            once /= h
            twice /= h * h
            # The derivatives come in with the second time.
            if change <= wanted or (time > 1 and change > last):
                break
            last = change
        for i in range(p):
            for k in range(modes):
                y[e, i, k] = parts[i, 0, k] + 1j * parts[i, 1, k]
                rate[e, i, k] = once[i, 0, k] + 1j * once[i, 1, k] + x[i] * y[e, i, k]
            for j in range(p):
                phase[e, i] += h * rule.integral[i, j] * x[j]
    return y, rate, phase, error
