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
    # Real and imaginary parts side by side: what real matrices act on. The rate x stands beside the shape y.
    parts, once, twice = np.zeros((p, 2 * modes + 2)), np.zeros((p, 2 * modes + 2)), np.zeros((p, 2 * modes + 2))
    both, slope, bend = parts.view(np.complex128), once.view(np.complex128), twice.view(np.complex128)
    z, x, dy, dx, ddy = both[:, :modes], both[:, modes], slope[:, :modes], slope[:, modes], bend[:, :modes]
    y = np.zeros((count, p, modes), np.complex128)
    new, rate = np.empty(modes, np.complex128), np.empty((count, p, modes), np.complex128)
    phase, error = np.zeros((count, p), np.complex128), np.zeros(count)
    decay = 0.5 * damping[n] / slowness[n]
    for e in range(count):
        h = widths[e]
        for i in range(p):
            x[i] = 1j * math.sqrt((1.0 + swing[e, i] * coupling[n, n]) / slowness[n]) - decay
            z[i] = 0.0
            z[i, n] = 1.0
        once[:], twice[:], last = 0.0, 0.0, np.inf
        for time in range(most):
            change = 0.0
            for i in range(p):
                bent = x[i] * x[i] + dx[i]
                for k in range(modes):
                    if k != n:
                        total = -coupling[k, k] * z[i, k]
                        for j in range(modes):
                            total += coupling[k, j] * z[i, j]
                        total = swing[e, i] * total + slowness[k] * (ddy[i, k] + 2.0 * x[i] * dy[i, k])
                        total += damping[k] * dy[i, k]
                        held = 1.0 + swing[e, i] * coupling[k, k] + slowness[k] * bent + damping[k] * x[i]
                        new[k] = -total * held.conjugate() / (held.real * held.real + held.imag * held.imag)
                new[n] = 1.0
                total = 0.0j
                for k in range(modes):
                    z[i, k] = new[k]
                    total += coupling[n, k] * new[k]
                found = 1j * np.sqrt((1.0 + swing[e, i] * total) / slowness[n] + dx[i] - decay * decay) - decay
                change = max(change, abs(found - x[i]) * h)
                x[i] = found
            error[e] = change * min(change / last, 1.0) if time > 1 else change
            np.dot(rule.first, parts, once)
            np.dot(rule.second, parts, twice)
            once /= h
            twice /= h * h
            # The derivatives come in with the second time.
            if change <= wanted or (time > 1 and change > last):
                break
            last = change
        for i in range(p):
            for k in range(modes):
                y[e, i, k] = z[i, k]
            for j in range(p):
                phase[e, i] += h * rule.integral[i, j] * x[j]
            for k in range(modes):
                rate[e, i, k] = dy[i, k] + x[i] * z[i, k]
    return y, rate, phase, error
