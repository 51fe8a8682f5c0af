"""How strongly changes of the force leave the strip's modes ringing, without following them.

A mode of the pace omega(phi) [1/rad], whose quasi-static amplitude is c(phi), obeys d'' + omega^2 d = -c'' beside it.
Over a stretch of the turn its ringing changes by int c' exp(i theta) dphi, theta' = omega, less what a motion without
ringing has at the stretch's two ends. By parts that is, once and again,

    B = c'/(i omega) - (c'/(i omega))'/(i omega) + ...

an asymptotic series, taken up to its least term. On elements of many radians the integral is the difference of B at the
ends, so that only the jumps of B between elements are left; shorter ones are integrated as they stand. The changes are
added up by magnitude; closing the turn enlarges them by at most 1/(2 |sin(theta(2 pi)/2)|) beside 1. To the leading
order in 1/omega, the modes taken one by one: an estimate within a small factor.

Source: A. Erdelyi, Asymptotic Expansions (1956), section 2.9; G. Floquet (1883).
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]

_DEGREE = 15
PLACES = 0.5 - 0.5 * np.cos(np.pi * np.arange(_DEGREE + 1) / _DEGREE)
"""Of an element, at which amplitudes and paces are wanted."""

_TERMS = 10
_MANY = 40.0
"""Radians in an element beyond which the series serves; without such elements the longest have to."""

_QUADRATURE = 36
_MOST_CLOSING = 30.0
"""The phase after a turn is not known well enough to tell a sharper resonance."""


def _matrices() -> tuple[Array, Array, Array, Array]:
    """From values at ``PLACES``: derivatives there, values at Gauss' points and integrals up to these, of the whole."""
    series = np.linalg.inv(chebyshev.chebvander(2.0 * PLACES - 1.0, _DEGREE))
    gauss = legendre.leggauss(_QUADRATURE)[0]
    integral = chebyshev.chebint(series, lbnd=-1.0, scl=0.5)
    return (
        chebyshev.chebval(2.0 * PLACES - 1.0, chebyshev.chebder(series, scl=2.0)).T,
        chebyshev.chebval(gauss, series).T,
        chebyshev.chebval(gauss, integral).T,
        chebyshev.chebval(1.0, integral),
    )


_DERIVATIVE, _AT_GAUSS, _TO_GAUSS, _WHOLE = _matrices()
_GAUSS = 0.5 * legendre.leggauss(_QUADRATURE)[1]


def ringing(widths: Array, still: Array, pace: Array) -> tuple[Array, Array]:
    """What the turn adds to each mode's ringing, and the factor by which closing it enlarges that: (modes,) each.

    From the quasi-static amplitudes and the paces at the elements' places, both (elements, places, modes).
    """
    found = [_of_one(widths, still[..., n], pace[..., n]) for n in range(still.shape[2])]
    added, closing = np.array(found).T
    return added, closing


def _of_one(widths: Array, still: Array, pace: Array) -> tuple[float, float]:
    rate = still @ _DERIVATIVE.T / widths[:, None]
    span = widths * (pace @ _WHOLE)
    ends = _without_ringing(widths, rate, pace)
    wide = span >= min(_MANY, 0.99 * span.max())
    total = 0.0
    # Begin with a wide element, so that every run of narrow ones lies between two of them.
    order = np.roll(np.arange(widths.size), -int(np.argmax(wide)))
    narrow = order[~wide[order]]
    integral = dict(zip(narrow, _integrated(widths[narrow], rate[narrow], pace[narrow]), strict=True))
    total, run, phase, before = 0.0, 0.0j, 0.0, ends[order[0], 1]
    for k in [*order[1:], order[0]]:
        if wide[k]:
            total += abs(before + run - ends[k, 0] * np.exp(1j * phase))
            before, run, phase = ends[k, 1], 0.0j, 0.0
        else:
            run += integral[k] * np.exp(1j * phase)
            phase += span[k]
    turn = abs(np.sin(0.5 * span.sum()))
    return total, max(1.0, min(0.5 / max(turn, 1e-300), _MOST_CLOSING))


def _integrated(widths: Array, rate: Array, pace: Array) -> NDArray[np.complex128]:
    """int c' exp(i theta) over each element, theta from its beginning."""
    phase = widths[:, None] * (pace @ _TO_GAUSS.T)
    return widths * (((rate @ _AT_GAUSS.T) * np.exp(1j * phase)) @ _GAUSS)


def _without_ringing(widths: Array, rate: Array, pace: Array) -> NDArray[np.complex128]:
    """B at both ends of each element, shape (elements, 2)."""
    # Every term is a real number times a power of i, beginning with 1/i.
    term, power = rate / pace, -1j
    total = power * term[:, [0, -1]]
    size, rows, span = np.abs(term).max(axis=1), np.arange(widths.size), pace * widths[:, None]
    for _ in range(_TERMS):
        term, power = (term @ _DERIVATIVE.T) / span[rows], 1j * power
        now = np.abs(term).max(axis=1)
        falls = now < size[rows]
        rows, term = rows[falls], term[falls]
        if not rows.size:
            break
        size[rows] = now[falls]
        total[rows] += power * term[:, [0, -1]]
    return total
