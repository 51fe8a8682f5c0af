"""Lagrangian method for the deflection limit: one multiplier, and a one-dimensional minimisation per station.

For a multiplier lambda the Lagrangian sum s_i (u_i + lambda (B_i/v + S_i phi)) - lambda separates into stations (or,
if the bore must narrow toward the middle, into blocks of equal u, found by pooling adjacent violators), each
minimised over all u (``solvers.pin.optimum.station_minimum``). The deflection decreases with lambda; 1/deflection^2
is nearly linear in it, so a safeguarded Newton method converges in a few rounds. The method is one compiled
function.

A station may jump to the solid section at a critical lambda. Of the stations that jump at the final lambda, as many
are made solid as the limit requires, and one takes an intermediate value. For independent stations this is optimal
up to that one station; panels are refined around it as around any kink.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.pin.optimum.program import Program, Weighed
from solvers.pin.optimum.station_minimum import TIGHT, minimiser, reach, stationary
from solvers.pin.section.flexibility import ShearFlexibility, curvatures, densities, flexibilities, slopes

Array = NDArray[np.float64]
_EPS = float(np.finfo(float).eps)
_MAX_ROUNDS = 200
CLOSE = 4e-14
"""Maximum relative margin of the converged deflection below its limit."""
_ROUNDING = 1e-14
"""Relative rounding error of a sum over stations."""
_LIMIT_TOLERANCE = 1e-12
"""Relative tolerance within which a deflection equals the limit."""
_FIRST_TOLERANCE = 1e-2
"""Relative step tolerance of the stations in the first round; later it is a thousandth of the deflection's excess."""
_JUMP_TOLERANCE = 1e-10
"""Relative tolerance of a multiplier at which stations jump, so that none fits the limit."""
_MIN_JUMP = 1e-6
"""Difference of two equally good walls above which it is a jump, not rounding."""


@kernel
def minimised(
    lam: float, share: Array, low: Array, bend: Array, shear: Array, reaches: Array, kappa: float, a: float, b: float,
    pooled: bool, turn: int, tolerance: float, u: Array,
) -> tuple[float, float]:  # fmt: skip
    """Minimise every station at multiplier ``lam``, in place and started from ``u``, a pin's to a last relative step of
    ``tolerance``: the error is about its square.

    Returns the deflection sum s g and its derivative with respect to lambda, excluding stations that become solid.
    ``pooled``: u (and low) non-decreasing along the stations up to ``turn``, and again from there on. ``reaches``
    (n, 2): ``reach`` of a pin's stations, unused for a bushing.
    """
    n = u.size
    w, wb, ws, lo, at = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    count = np.empty(n, dtype=np.int64)
    top, first, k = -1, 0, 1.0 / lam
    for i in range(n):
        top += 1
        if i == turn:
            first = top
        w[top], wb[top], ws[top], lo[top], count[top] = share[i], share[i] * bend[i], share[i] * shear[i], low[i], 1
        if kappa >= 0.0:
            at[top] = minimiser(lam, 1.0, bend[i], shear[i], low[i], u[i], kappa, a, b)
        elif k < reaches[i, 1]:
            at[top] = 1.0
        else:
            at[top] = stationary(k, low[i], reaches[i, 0], bend[i], shear[i], u[i], a, b, tolerance)
        while pooled and top > first and at[top - 1] > at[top]:
            w[top - 1] += w[top]
            wb[top - 1] += wb[top]
            ws[top - 1] += ws[top]
            lo[top - 1] = lo[top]
            count[top - 1] += count[top]
            top -= 1
            at[top] = minimiser(lam, w[top], wb[top], ws[top], lo[top], at[top], kappa, a, b)
    total, change, i = 0.0, 0.0, 0
    for block in range(top + 1):
        x = at[block]
        for _ in range(count[block]):
            u[i] = x
            i += 1
        if wb[block] == 0.0 and ws[block] == 0.0:
            continue
        f, g = flexibilities(x, kappa, a, b)
        total += wb[block] * f + ws[block] * g
        if lo[block] < x and (kappa >= 0.0 or x < 1.0):
            (df, dg), (d2f, d2g) = slopes(x, kappa, a, b), curvatures(x, kappa, a, b)
            slope, curve = wb[block] * df + ws[block] * dg, max(wb[block] * d2f + ws[block] * d2g, 1e-300)
            change -= slope * slope / (lam * curve)
    return total, change


@kernel
def reaches_of(low: Array, bend: Array, shear: Array, kappa: float, a: float, b: float) -> Array:
    """``reach`` of a pin's stations, (n, 2); empty for a bushing."""
    found = np.empty((low.size if kappa < 0.0 else 0, 2))
    for i in range(found.shape[0]):
        found[i, 0], found[i, 1] = reach(low[i], bend[i], shear[i], a, b)
    return found


@kernel
def _copy(values: Array, to: Array) -> None:
    # An explicit loop: whole-array assignment adds seconds of compile time, mostly for its error message.
    for i in range(to.size):
        to[i] = values[i]


@kernel
def _deflection(share: Array, bend: Array, shear: Array, kappa: float, a: float, b: float, u: Array) -> float:
    """Return sum s g over the loaded stations; inf if one of them has no section."""
    total = 0.0
    for i in range(u.size):
        if bend[i] > 0.0 or shear[i] > 0.0:
            if u[i] <= 0.0:
                return np.inf
            f, g = flexibilities(u[i], kappa, a, b)
            total += share[i] * (bend[i] * f + shear[i] * g)
    return total


@kernel
def _search(
    share: Array, low: Array, bend: Array, shear: Array, kappa: float, a: float, b: float,
    monotone: bool, turn: int, solid: Array, best: Array, short: Array,
) -> tuple[float, int, float]:  # fmt: skip
    """Return (multiplier, rounds, deflection relative to its limit) of the minimum volume.

    ``best`` receives its u, ``short`` that of the greatest multiplier found too small. The multiplier is NaN if even
    ``solid`` is too soft, and inf if only ``solid`` suffices; a bushing is always feasible.
    """
    _copy(low, best)
    total = _deflection(share, bend, shear, kappa, a, b, low)
    if total <= 1.0 + _ROUNDING:
        return 0.0, 0, total
    _copy(solid, best)
    least = _deflection(share, bend, shear, kappa, a, b, solid) if kappa < 0.0 else 0.0
    if least > 1.0 + _LIMIT_TOLERANCE:
        return np.nan, 0, least
    if least >= 1.0 - _LIMIT_TOLERANCE:
        return np.inf, 0, least
    # Exact for thin walls without lower bounds; an initial guess otherwise.
    lam = 0.0
    for i in range(low.size):
        lam += share[i] * math.sqrt(0.5 * bend[i] + shear[i] * (a + 0.25 * b * abs(kappa)))
    lam *= lam
    u = np.empty(low.size)
    _copy(low, u)
    _copy(low, short)
    lower, upper, found, kept = 0.0, np.inf, np.inf, least
    reaches, rounds, tolerance = reaches_of(low, bend, shear, kappa, a, b), 0, _FIRST_TOLERANCE
    while rounds < _MAX_ROUNDS:
        rounds += 1
        total, change = minimised(lam, share, low, bend, shear, reaches, kappa, a, b, monotone, turn, tolerance, u)
        tolerance = max(TIGHT, min(_FIRST_TOLERANCE, 1e-3 * abs(total - 1.0)))
        if total <= 1.0:
            _copy(u, best)
            found = upper = lam
            kept = total
            if total >= 1.0 - CLOSE:
                break
        else:
            lower = lam
            _copy(u, short)
        if upper < np.inf and upper - lower <= _JUMP_TOLERANCE * upper:
            break
        # 1/total^2 is nearly linear in lambda; aim slightly inside the limit.
        new = np.nan
        if change < 0.0:
            aim = 1.0 - 0.4 * CLOSE
            new = lam + (1.0 / (aim * aim) - 1.0 / (total * total)) / (-2.0 * change / (total * total * total))
        if not lower < new < upper:
            if lower > 0.0 and upper < np.inf:
                new = math.sqrt(lower * upper)
            else:
                new = 16.0 * lam if upper == np.inf else 0.0625 * upper
        lam = new
    return found, rounds, kept


@kernel
def _lightest(
    share: Array, low: Array, bending: Array, shear: Array, limit: float, kappa: float, a: float, b: float,
    anchor: int, monotone: bool, best: Array, short: Array,
) -> tuple[float, int, float]:  # fmt: skip
    """As ``_search``, over all stations of a program.

    Stations without deflection keep their minimum walls, unless walls must not thin toward the middle; the second
    half is traversed from its end.
    """
    n = low.size
    order = np.empty(n, dtype=np.int64)
    table = np.empty((7, n))
    count = 0
    for k in range(n):
        i = k if k < anchor else n - 1 + anchor - k
        pulls = bending[i] > 0.0 or shear[i] > 0.0
        if monotone or pulls:
            order[count] = i
            table[0, count], table[1, count] = share[i], low[i]
            table[2, count], table[3, count] = bending[i] / limit, shear[i] / limit
            before = table[4, count - 1] if count > 0 and k != anchor else 0.0
            table[4, count] = 1.0 if pulls else max(low[i], before)
            count += 1
    own_best, own_short = table[5][:count], table[6][:count]
    found = _search(
        table[0][:count], table[1][:count], table[2][:count], table[3][:count], kappa, a, b,
        monotone, anchor, table[4][:count], own_best, own_short,
    )  # fmt: skip
    _copy(low, best)
    _copy(low, short)
    for i in range(count):
        best[order[i]], short[order[i]] = own_best[i], own_short[i]
    return found


@dataclass(frozen=True)
class Segments:
    """The sections that a deflection limit couples: n stations, or n whole segments of uniform wall.

    ``share``, and the coefficients B and S (``bending``, ``shear``) in metres, (n,) each; the ``limit`` [m]; ``kappa``
    and ``law`` of the flexibilities; ``anchor``, the index of the first section of the second half.
    """

    share: Array
    bending: Array
    shear: Array
    limit: float
    kappa: float
    law: ShearFlexibility
    anchor: int

    def deflections(self, u: Array) -> Array:
        """Contributions to the deflection [m]."""
        return self.share * densities(u, self.bending, self.shear, self.kappa, self.law.a, self.law.b)


def weigh(program: Program, low: Array | None, monotone: bool) -> Weighed | None:
    """Find the minimum volume that satisfies the deflection limit; None if even the solid pin exceeds it.

    ``low`` is the lower bound of u at every station, by default the program's (see ``weigh_segments``).
    """
    p, low = program, program.lower if low is None else low
    if p.limit is None:
        return Weighed(low, 0.0, 0)
    own = Segments(p.share, p.bending, p.shear, p.limit, p.sought.kappa, p.law, p.anchor)
    return weigh_segments(own, low, monotone)


def weigh_segments(own: Segments, low: Array, monotone: bool) -> Weighed | None:
    """Find the minimum volume above ``low`` that satisfies the deflection limit; None if even the solid pin exceeds it.

    With ``monotone`` u and ``low`` are non-decreasing toward the middle. The solution is feasible, with a relative
    slack of at most CLOSE.
    """
    best, short = np.empty_like(low), np.empty_like(low)
    multiplier, rounds, total = _lightest(
        own.share, low, own.bending, own.shear, own.limit, own.kappa, own.law.a, own.law.b, own.anchor, monotone,
        best, short,
    )  # fmt: skip
    if math.isnan(multiplier):
        return None
    if 0.0 < multiplier < math.inf and total < 1.0 - _LIMIT_TOLERANCE:
        best = _interpolated(own, short, best) if monotone else _partial_jump(own, short, best)
    return Weighed(best, multiplier, rounds)


def _partial_jump(own: Segments, short: Array, enough: Array) -> Array:
    """Move as many of the jumping stations from ``short`` to ``enough`` as the limit requires; one is interpolated."""
    jump = np.flatnonzero(enough - short > _MIN_JUMP)
    u = enough.copy()
    stiff = own.deflections(enough)
    softer = np.cumsum((own.deflections(short) - stiff)[jump])
    room = own.limit * (1.0 - 0.4 * CLOSE) - float(stiff.sum())
    spared = int(np.searchsorted(softer, room, side="right"))
    u[jump[:spared]] = short[jump[:spared]]
    if spared == jump.size:
        return _interpolated(own, short, u)
    last = np.zeros(u.size, dtype=bool)
    last[jump[spared]] = True
    return _interpolated(own, np.where(last, short, u), u)


def _interpolated(own: Segments, short: Array, enough: Array) -> Array:
    """Return the solution between a too soft and a feasible one whose deflection lies slightly inside the limit."""
    from scipy.optimize import brentq

    def room(part: float) -> float:
        return own.limit / float(own.deflections(short + part * (enough - short)).sum()) - 1.0 - 0.4 * CLOSE

    soft = room(0.0)
    if not soft < 0.0 < room(1.0):
        return enough
    part = brentq(room, 0.0, 1.0, xtol=max(0.1 * CLOSE / -soft, _EPS), rtol=4.0 * _EPS)
    return short + (part if room(part) >= -0.4 * CLOSE else 1.0) * (enough - short)
