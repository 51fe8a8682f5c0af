"""Local searches over logarithmic sizes that only use the check.

Four methods, each with its own starts: SLSQP with one-sided differences, fast if every limit is smooth; COBYQA, which
models values only; the Nelder-Mead simplex on the penalised cost, without derivatives; and sequential linear
programming in a trust region, with all tangents seen in it. The last one handles corners: a fatigue safety is a minimum
over sections and fibres, and where two govern, one gradient is not enough.

Sizes on a grid or from a stock are first relaxed, then fixed to neighbouring grid values, optimising the continuous
sizes for each, until no neighbour is better.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import NonlinearConstraint, linprog, minimize, minimize_scalar

from oracles.rivals.hunt import PENALTY, PULLS, PUSH, Array, Hunt, Look, Spent

_DIFFERENCES = (3e-7, 3e-5)
"""Finite-difference steps of the linear programs, growing with the trust region."""
_LEAST_REACH, _LEAST_GAIN = 1e-6, 1e-9
_CURVED = 0.02
"""Tangents are kept while a curvature of order 1 changes them by less than this fraction of the trust region."""
_STRADDLED = 30.0
"""An upper bound on the logarithmic curvature of limits."""
_RIDGE_STEPS, _RIDGE_REACH, _RIDGE_LOOKS = (1e-5, 1e-4, 1e-3), 5.0, 12
"""Search along a ridge: step lengths, half-width of the search across the ridge in such steps, and evaluations of
it."""
_POLISH = 1e-3
"""Trust region of the linear programs that repair another search's end point."""

Tangent = tuple[Array, Look, Array, Array]
"""A part (logarithmic), its evaluation, and the gradients of cost and margins."""
Way = Callable[[Hunt, Array, tuple[int, ...], float], Array]
"""A search from a start (logarithmic) over some of the sizes with an initial step; returns its end point."""


def slsqp(hunt: Hunt, start: Array, free: tuple[int, ...], reach: float) -> Array:
    """scipy's SLSQP; ``reach`` is ignored."""

    def whole(x: Array) -> Array:
        logs = start.copy()
        logs[list(free)] = x
        return hunt.clipped(logs)

    found = minimize(
        lambda x: hunt.at(whole(x)).cost,
        start[list(free)],
        jac=lambda x: hunt.slopes(whole(x), free)[0],
        bounds=_box(hunt, free),
        constraints={
            "type": "ineq",
            "fun": lambda x: hunt.at(whole(x)).margins - PUSH,
            "jac": lambda x: hunt.slopes(whole(x), free)[1],
        },
        method="SLSQP",
        options={"ftol": 1e-11, "maxiter": 60},
    )
    return whole(found.x) if np.all(np.isfinite(found.x)) else start


def cobyqa(hunt: Hunt, start: Array, free: tuple[int, ...], reach: float) -> Array:
    """scipy's COBYQA."""

    def whole(x: Array) -> Array:
        logs = start.copy()
        logs[list(free)] = x
        return hunt.clipped(logs)

    found = minimize(
        lambda x: hunt.at(whole(x)).cost,
        start[list(free)],
        bounds=_box(hunt, free),
        constraints=NonlinearConstraint(lambda x: hunt.at(whole(x)).margins, PUSH, np.inf),
        method="COBYQA",
        options={"initial_tr_radius": reach, "final_tr_radius": 1e-4 if hunt.rough else 1e-8, "maxfev": 1000},
    )
    return whole(found.x)


def nelder_mead(hunt: Hunt, start: Array, free: tuple[int, ...], reach: float) -> Array:
    """scipy's Nelder-Mead on the penalised cost, from a simplex of edge length ``reach``."""
    index = list(free)

    def whole(x: Array) -> Array:
        logs = start.copy()
        logs[index] = x
        return hunt.clipped(logs)

    # toward the farther bound, so that the simplex does not degenerate at the nearer one
    room = np.log(hunt.space.upper[index]) - start[index] > start[index] - np.log(hunt.space.lower[index])
    edges = np.diag(np.where(room, reach, -reach))
    found = minimize(
        lambda x: hunt.merit(whole(x)),
        start[index],
        method="Nelder-Mead",
        options={"initial_simplex": np.vstack([start[index], start[index] + edges]), "xatol": 1e-8, "fatol": 1e-10},
    )
    return whole(found.x)


def linear_programs(hunt: Hunt, start: Array, free: tuple[int, ...], reach: float) -> Array:
    """min max_k (c_k + g_k d_k) + M t under m_k + J_k d_k + t >= 0 for all nearby tangents k, |d| <= reach.

    A single uphill step is allowed: a curved limit is violated by the first step along it and met again after the
    second.
    """
    index, here, strayed, rng = list(free), hunt.clipped(start), False, np.random.default_rng(0)
    best, value = here, hunt.merit(here)

    def tangent() -> Tangent:
        """Evaluated slightly off the point: exactly at a corner, each difference may see a different side."""
        difference = min(max(0.01 * reach, _DIFFERENCES[0]), _DIFFERENCES[1])
        aside = here.copy()
        aside[index] += 10.0 * difference * rng.uniform(-1.0, 1.0, len(free))
        aside = hunt.clipped(aside)
        return aside, hunt.at(aside), *hunt.slopes(aside, free, difference)

    seen = [tangent()]
    while reach > _LEAST_REACH:
        promised, step = _programmed(hunt, seen, here, index, reach)
        if promised > value - _LEAST_GAIN:
            here, strayed, reach = best, False, 0.25 * reach
            continue
        here = here.copy()
        here[index] += step
        here = hunt.clipped(here)
        seen.append(tangent())
        gained = (value - hunt.merit(here)) / (value - promised)
        if gained > 0.05:
            best, value, strayed = here, hunt.merit(here), False
            reach *= 2.0 if gained > 0.7 else 1.0
        elif strayed:
            here, strayed, reach = best, False, 0.3 * reach
        else:
            strayed = True
    return best


def _programmed(hunt: Hunt, seen: list[Tangent], here: Array, index: list[int], reach: float) -> tuple[float, Array]:
    """The predicted merit and the step, in units of the trust region, so that solver tolerances are relative to it."""
    level, near = hunt.at(here).cost, []
    for number, (point, *_) in enumerate(seen):
        far = np.abs(point - here).max()
        if (far <= 2.0 * reach or far**2 <= _CURVED * reach) and _holds(seen, number, index):
            near.append(seen[number])
    rows, right = [], []
    for point, look, cost, margins in near or seen[-1:]:
        apart = (here - point)[index]
        # the step d, the maximum tangent of the cost, and the slack t
        rows.append(np.concatenate([cost, [-1.0, 0.0]]))
        right.append((level - look.cost - cost @ apart) / reach)
        rows += [np.concatenate([-slope, [0.0, -1.0]]) for slope in margins]
        right += list((look.margins + margins @ apart - PUSH) / reach)
    low, high = np.log(hunt.space.lower[index]) - here[index], np.log(hunt.space.upper[index]) - here[index]
    within = np.minimum(np.maximum(low / reach, -1.0), 0.0), np.maximum(np.minimum(high / reach, 1.0), 0.0)
    goal = np.concatenate([np.zeros(len(index)), [1.0, PENALTY]])
    bounds = [*zip(*within, strict=True), (None, None), (0.0, None)]
    solved = linprog(goal, np.array(rows), np.array(right), bounds=bounds)
    if solved.x is None:
        return math.inf, np.zeros(len(index))
    return level + reach * solved.fun, reach * solved.x[: len(index)]


def _holds(seen: list[Tangent], number: int, index: list[int]) -> bool:
    """Whether a tangent lies above all margins evaluated elsewhere, up to curvature.

    Limits are minima of smooth functions. A tangent whose finite differences straddled a corner lies below some of
    them.
    """
    point, look, _, margins = seen[number]
    for other, there, *_ in seen:
        apart = other - point
        if np.any(there.margins > look.margins + margins @ apart[index] + _STRADDLED * np.abs(apart).max() ** 2 + PUSH):
            return False
    return True


def _box(hunt: Hunt, free: tuple[int, ...]) -> list[tuple[float, float]]:
    return [(math.log(hunt.space.lower[i]), math.log(hunt.space.upper[i])) for i in free]


POLISHER = "linear programs"
WAYS: dict[str, Way] = {"SLSQP": slsqp, "COBYQA": cobyqa, "Nelder-Mead": nelder_mead, POLISHER: linear_programs}


def search(hunt: Hunt, way: str, start: Array, evaluations: int, reach: float) -> None:
    """Run one local search; its result is kept by the hunt."""
    hunt.allow(evaluations, way)
    everything = hunt.space.free
    start = hunt.clipped(start)
    with contextlib.suppress(Spent):
        hunt.at(start)
        if everything:
            WAYS[way](hunt, start, everything, reach)
            hunt.settle()
    end = hunt.lead[1] if hunt.lead else start
    if everything and way != POLISHER and not hunt.rough:
        hunt.allow(evaluations // 2, f"{way}, then {POLISHER}")
        with contextlib.suppress(Spent):
            WAYS[POLISHER](hunt, end, everything, _POLISH)
        end = hunt.lead[1] if hunt.lead else end
    with contextlib.suppress(Spent):
        hunt.allow_more(PULLS)
        hunt.pull_in()
    if hunt.space.stepped:
        hunt.allow(evaluations, f"{way}, then over the grid")
        with contextlib.suppress(Spent):
            _walk(hunt, way, end, tuple(i for i in everything if i not in hunt.space.stepped), reach)


def finish(hunt: Hunt, start: Array, evaluations: int) -> None:
    """Search closely around a start by linear programs and along ridges, with the sizes on a grid fixed."""
    free = tuple(i for i in hunt.space.free if i not in hunt.space.stepped)
    hunt.allow(evaluations, f"{POLISHER}, to the last")
    with contextlib.suppress(Spent):
        hunt.at(start)
        if free:
            linear_programs(hunt, start, free, _POLISH)
    with contextlib.suppress(Spent):
        hunt.allow_more(PULLS)
        hunt.pull_in()
    hunt.allow(evaluations, "along a ridge")
    with contextlib.suppress(Spent):
        along_ridges(hunt, start, free)


def along_ridges(hunt: Hunt, start: Array, free: tuple[int, ...]) -> Array:
    """Steps of one size, with another re-optimised at each. Returns the end point.

    Where two results are equally great, gradients belong to one of them only, and every straight step off the ridge
    between them is worse.
    """
    here, low, high = hunt.clipped(start), np.log(hunt.space.lower), np.log(hunt.space.upper)
    inside = [i for i in free if min(here[i] - low[i], high[i] - here[i]) > _LEAST_REACH]
    for along, across in itertools.permutations(inside, 2):
        for step in np.outer(_RIDGE_STEPS, (1.0, -1.0)).ravel().tolist():
            while True:
                there = _stepped(hunt, here, along, across, step)
                if not hunt.merit(there) < hunt.merit(here) - _LEAST_GAIN:
                    break
                here = there
    return here


def _stepped(hunt: Hunt, here: Array, along: int, across: int, step: float) -> Array:
    """A step of one size, with another re-optimised."""

    def at(y: float) -> Array:
        logs = here.copy()
        logs[[along, across]] += step, y
        return hunt.clipped(logs)

    reach = _RIDGE_REACH * abs(step)
    options = {"maxiter": _RIDGE_LOOKS, "xatol": 1e-3 * abs(step)}
    return at(minimize_scalar(lambda y: hunt.merit(at(y)), bounds=(-reach, reach), method="bounded", options=options).x)


def look_beside(hunt: Hunt, start: Array, steps: int, evaluations: int) -> None:
    """Search all grid points up to ``steps`` from a start, by SLSQP over the continuous sizes."""
    stepped, grids = hunt.space.stepped, hunt.space.grids
    free = tuple(i for i in hunt.space.free if i not in stepped)
    near = []
    for i in stepped:
        at = int(np.abs(np.log(grids[i]) - start[i]).argmin())
        near.append(np.log(grids[i][max(at - steps, 0) : at + steps + 1]))
    for place in itertools.product(*near):
        logs = start.copy()
        logs[list(stepped)] = place
        hunt.allow(evaluations, "SLSQP, beside on the grid")
        with contextlib.suppress(Spent):
            hunt.at(logs)
            if free:
                slsqp(hunt, logs, free, 0.0)


def _walk(hunt: Hunt, way: str, start: Array, free: tuple[int, ...], reach: float) -> None:
    """Descend over the grid: from the point nearest to the start to its best neighbour, until no neighbour is better;
    the ``free`` sizes are optimised at each point."""
    stepped, grids = hunt.space.stepped, hunt.space.grids
    here = tuple(int(np.abs(np.log(grids[i]) - start[i]).argmin()) for i in stepped)
    done: dict[tuple[int, ...], tuple[float, Array]] = {}

    def best_at(place: tuple[int, ...], logs: Array) -> float:
        if place not in done:
            logs = logs.copy()
            for i, n in zip(stepped, place, strict=True):
                logs[i] = math.log(grids[i][n])
            end = WAYS[way](hunt, logs, free, reach) if free else logs
            done[place] = hunt.merit(end), end
        return done[place][0]

    best_at(here, start)
    while True:
        near = [tuple(n + d for n, d in zip(here, moves, strict=True)) for moves in _moves(len(stepped))]
        near = [p for p in near if all(0 <= n < grids[i].size for i, n in zip(stepped, p, strict=True))]
        best = min(near, key=lambda place: best_at(place, done[here][1]), default=here)
        if best_at(best, start) >= done[here][0]:
            return
        here = best


def _moves(count: int) -> list[tuple[int, ...]]:
    """Moves to all neighbours on a grid, those in a single size first."""
    moves = [m for m in itertools.product((-1, 0, 1), repeat=count) if any(m)]
    return sorted(moves, key=lambda m: sum(map(abs, m)))
