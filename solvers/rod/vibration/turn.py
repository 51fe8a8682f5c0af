"""A turn of the strip put together from its elements and closed.

A panel lies between two corners of the force. There slow modes, which anything may have set going, are followed by
collocation, and fast ones follow them (``slow_modes``); where it matters fast modes ring behind corners (``ringing``).
A panel's unknowns are the first states of its slow modes and the real and imaginary parts of its ringing; states that
are equal on both sides of every corner determine them. Several strips may be treated side by side: then all arrays
have a leading axis of strips (``equation``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from solvers.numerics.jit import kernel
from solvers.numerics.radau import Radau
from solvers.rod.vibration.equation import StripEquation, each
from solvers.rod.vibration.ringing import FreeModes
from solvers.rod.vibration.slow_modes import Parts, carried, factor, slow_motion, substitute

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_TERMS = 9
_LOOSEST = 1e-4


@dataclass(frozen=True)
class Turn:
    """What a turn is made of, before it is closed: of every element for unit first states (a, sqrt(mu) a') of the slow
    modes and, last, for none.

    widths    (..., elements), those behind corners being ``first`` (panels,), those before the next ones ``stop``
    swing     (..., elements, points), ``still`` (..., elements, points, modes) the quasi-static amplitudes
    columns   (..., elements, points, 2 m + 1, modes) and ``speeds`` (..., elements, 2, 2 m + 1, fast) of the fast modes
              at the two ends, in coordinates of ``slow_modes``, which ``turned`` takes to modes
    change    what the series of the fast modes changed at last, and ``fell`` by how much less than before
    onward    (..., elements, 2 m + 1, 2 m + 1), from the panel's first state, and 1, to the element's
    ends      (..., panels, 2 m + 1, 2 m), from there to the panel's last
    """

    equation: StripEquation
    slow: int
    widths: Array
    first: NDArray[np.int64]
    stop: NDArray[np.int64]
    swing: Array
    still: Array
    columns: Array
    speeds: Array
    change: Array
    fell: Array
    turned: Array
    onward: Array
    ends: Array

    @staticmethod
    def of(
        equation: StripEquation,
        rule: Radau,
        states: Array,
        edges: Array,
        first: NDArray[np.int64],
        slow: int,
        wanted: float,
    ) -> Turn:
        """From states (rows, ..., elements points) at a rule's points of elements between edges (..., elements + 1);
        series that could give more than ``wanted`` are not asked to."""
        widths, modes, p = np.diff(edges), equation.slowness.shape[-1], rule.points.size
        shape, count = (*widths.shape, p), widths.shape[-1]
        swing, still = equation.swing(states).reshape(shape), equation.still(states)
        right = equation.right(states, still).reshape(*shape, modes)
        still = still.reshape(*shape, modes)
        if equation.loss:
            # What follows the force is not damped.
            moved = (rule.first @ still) / widths[..., None, None]
            right += equation.damping[..., None, None, :] * moved
        parts, turned = _parts(equation, slow)
        strips = equation.mean.shape
        columns, last, speeds, change, fell = each(
            strips,
            lambda w, s, r, *own: slow_motion(w, s, r, Parts(*own), rule, min(wanted, _LOOSEST), _TERMS),
            widths,
            swing,
            right @ turned[..., None, :, :],
            *parts,
        )
        starts = np.zeros(count, dtype=np.bool_)
        starts[first] = True
        (maps,) = each(strips, lambda states: (carried(states, starts),), last)
        onward = np.zeros((*widths.shape, 2 * slow + 1, 2 * slow + 1))
        onward[..., :-1], onward[..., -1, -1] = maps[..., 0, :, :], 1.0
        stop = np.append(first[1:], count) - 1
        return Turn(
            equation, slow, widths, first, stop, swing, still, columns, speeds, change, fell, turned, onward,
            maps[..., stop, 1, :, :],
        )  # fmt: skip

    @property
    def _root(self) -> Array:
        """sqrt(mu) of the fast modes, (..., 1, 1, fast)."""
        return np.sqrt(self.equation.slowness[..., None, None, self.slow :])

    @property
    def _fast(self) -> Array:
        """From the coordinates of the fast modes to these, (..., 1, fast, fast)."""
        return self.turned[..., None, self.slow :, self.slow :].mT

    @cached_property
    def sides(self) -> tuple[Array, Array]:
        """States (..., panels, 2 m + 1, 2 modes) behind and before corners, of the panels that these begin and end:
        first of slow modes, amplitudes and then speeds, then amplitude and speed of every fast one."""
        m, modes, count = self.slow, self.equation.slowness.shape[-1], self.first.size
        out = np.zeros((2, *self.swing.shape[:-2], count, 2 * m + 1, 2 * modes))
        for state, e, point, end in ((out[0], self.first, 0, 0), (out[1], self.stop, -1, 1)):
            state[..., 2 * m :: 2] = self.columns[..., e, point, :, m:] @ self._fast
            state[..., 2 * m + 1 :: 2] = self.speeds[..., e, end, :, :] @ self._fast * self._root
        lefts, rights = out[0], self.onward[..., self.stop, :, :] @ out[1]
        lefts[..., : 2 * m], rights[..., : 2 * m] = np.eye(2 * m + 1, 2 * m), self.ends
        return lefts, rights

    def closed(self, free: FreeModes | None = None) -> tuple[Array, Complex, Array]:
        """The slow modes' first states in every panel (..., panels, 2 m), the amplitudes of what rings behind corners
        (..., panels, ringing), and by which closing the turn enlarges what one turn misses."""
        m, (lefts, rights) = self.slow, self.sides
        if free is None:
            unknowns, amplification = closed(lefts[..., : 2 * m], rights[..., : 2 * m])
            return unknowns, np.zeros((*unknowns.shape[:-1], 0), np.complex128), amplification
        both = []
        for slow, rung in ((lefts, free.behind(self.equation)), (rights, free.before(self.equation))):
            known = slow[..., : rung.shape[-1]]
            both.append(np.concatenate([known[..., :-1, :], rung, known[..., -1:, :]], axis=-2))
        unknowns, amplification = closed(*both)
        return unknowns[..., : 2 * m], unknowns[..., 2 * m :: 2] + 1j * unknowns[..., 2 * m + 1 :: 2], amplification

    def begin(self, begun: Array) -> Array:
        """First states, and 1, of all elements (..., elements, 2 m + 1), from those of the panels."""
        number = np.repeat(np.arange(self.first.size), self.stop - self.first + 1)
        return (with_one(begun)[..., number, None, :] @ self.onward)[..., 0, :]

    def amplitudes(self, begin: Array) -> Array:
        """Of the modes, without what rings: (..., elements, points, modes)."""
        return (begin[..., None, None, :] @ self.columns)[..., 0, :] @ self.turned[..., None, :, :].mT

    def fast_speeds(self, begin: Array) -> Array:
        """Speeds of the fast modes at the elements' two ends, times sqrt(mu): (..., elements, 2, fast)."""
        return (begin[..., None, None, :] @ self.speeds)[..., 0, :] @ self._fast * self._root


def with_one(unknowns: Array) -> Array:
    """The unknowns (..., unknowns), and 1 for what none of them makes."""
    return np.concatenate([unknowns, np.ones((*unknowns.shape[:-1], 1))], axis=-1)


def closed(lefts: Array, rights: Array) -> tuple[Array, Array]:
    """The unknowns of every panel (..., panels, unknowns), from the states at the panels' two ends for unit unknowns
    and, last, for none, (..., panels, unknowns + 1, unknowns) each; and the greatest factor by which closing the turn
    enlarges what one turn misses, (...): infinite, and the unknowns nought, exactly at a resonance without damping."""
    unknowns = lefts.shape[-1]
    if unknowns == 0:
        return np.empty((*lefts.shape[:-2], 0)), np.ones(lefts.shape[:-3])
    strips = lefts.shape[:-3]
    steps, whole = each(strips, _steps, np.ascontiguousarray(lefts), np.ascontiguousarray(rights))
    missing = np.eye(unknowns) - whole[..., :-1, :]
    least = np.linalg.svd(missing, compute_uv=False)[..., -1]
    fine = (least > 0.0)[..., None]
    begun = np.linalg.solve(np.where(fine[..., None], missing, np.eye(unknowns)).mT, whole[..., -1, :, None])[..., 0]
    (found,) = each(strips, lambda own, first: (_along(own, first),), steps, np.where(fine, begun, 0.0))
    with np.errstate(divide="ignore"):
        return found, 1.0 / least


@kernel
def _steps(lefts: Array, rights: Array) -> tuple[Array, Array]:
    """Maps from every panel's unknowns, and 1, to those of the next one, (panels, unknowns + 1, unknowns), and that of
    the whole turn, from the states at the panels' ends."""
    count, u = lefts.shape[0], lefts.shape[2]
    steps, whole, before = np.empty((count, u + 1, u)), np.zeros((u + 1, u)), np.empty((u + 1, u))
    matrix, order, right = np.empty((u, u)), np.empty(u, np.int64), np.empty((u, u + 1))
    for a in range(u):
        whole[a, a] = 1.0
    for k in range(count):
        after = (k + 1) % count
        for a in range(u):
            for b in range(u):
                matrix[a, b] = lefts[after, b, a]
            for c in range(u + 1):
                right[a, c] = rights[k, c, a]
            right[a, u] -= lefts[after, u, a]
        factor(matrix, order)
        substitute(matrix, order, right)
        before[:] = whole
        for c in range(u + 1):
            for a in range(u):
                steps[k, c, a] = right[a, c]
                total = right[a, u] if c == u else 0.0
                for b in range(u):
                    total += before[c, b] * right[a, b]
                whole[c, a] = total
    return steps, whole


@kernel
def _along(steps: Array, begun: Array) -> Array:
    """The unknowns of all panels, (panels, unknowns), from those of the first."""
    count, u = steps.shape[0], steps.shape[2]
    out = np.empty((count, u))
    out[0] = begun
    for k in range(count - 1):
        for a in range(u):
            total = steps[k, u, a]
            for b in range(u):
                total += out[k, b] * steps[k, b, a]
            out[k + 1, a] = total
    return out


def _parts(equation: StripEquation, m: int) -> tuple[Parts, Array]:
    """The equation in coordinates of which the first m are modes and the rest makes G diagonal; these in modes."""
    rates, rest = np.linalg.eigh(equation.coupling[..., m:, m:])
    modes, strips = equation.slowness.shape[-1], equation.mean.shape
    turned = np.zeros((*strips, modes, modes))
    turned[..., range(m), range(m)], turned[..., m:, m:] = 1.0, rest
    parts = Parts(
        np.ascontiguousarray(equation.slowness[..., :m]),
        np.ascontiguousarray(equation.damping[..., :m]),
        np.ascontiguousarray(equation.coupling[..., :m, :m]),
        np.ascontiguousarray(equation.coupling[..., :m, m:] @ rest),
        rates,
        (rest.mT * equation.slowness[..., None, m:]) @ rest,
        (rest.mT * equation.damping[..., None, m:]) @ rest,
        np.ascontiguousarray(equation.clamp @ turned),
    )
    return parts, turned
