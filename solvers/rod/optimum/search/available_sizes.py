"""The optimum on the full model among sizes that come in steps or from a stock.

The core's search is exhaustive over such sizes too. Its limits are shifted by what the full model changes at the strip
found, and it is done again until its strip is one that the full model has been asked about: so far the full model's
change is taken to be the same for all strips. Then the sizes next to the best strip are looked through one by one: what
the core, corrected at that strip, believes to be better by more than it may be wrong, or nearly admissible, is checked
on the full model - with the sizes that may be chosen at will searched anew, if there are any - the most promising
first, and again around every better strip. Where the strip rings, other gaps between resonances are looked into: by
paths of sizes chosen at will if the thickness may be (``gaps``), by rows of lengths if it comes from a stock
(``lengths_over_gaps``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from solvers.rod.constraints import Limits
from solvers.rod.optimum.core.optimum import dimensions_within, polish
from solvers.rod.optimum.full_model.corrections import frequency_slopes
from solvers.rod.optimum.full_model.strip import logarithms
from solvers.rod.optimum.search.full_optimum import Context, Optimum, at_full_accuracy, conditions_at, search_other_gaps
from solvers.rod.optimum.search.gaps import Gaps
from solvers.rod.optimum.search.lengths_over_gaps import promising_lengths
from solvers.rod.optimum.search.local_search import Iterate, Local, local_search
from solvers.rod.optimum.sensitivities import Stationarity
from solvers.rod.problem import Bounds
from solvers.rod.scene import Dimensions

_SHIFTS = 5
_MOST_LOOKED_AT = 40
"""Sizes looked at on the full model around one strip."""
_WRONG = 0.3
"""Of the distance in logarithms: what the corrected core may be wrong by, per unit of distance."""
_SLICES, _ROWS = 4, 6
"""In other gaps, that are looked at; rows of lengths of a width and a thickness."""
_ELSEWHERE = 0.02
"""In ln b, ln h, ln l: a slice is searched once more from a strip that far from others."""
_STEPS = 2
"""So many steps to each side are next to a strip."""


def discrete_optimum(context: Context, starts: Sequence[Dimensions]) -> Optimum | None:
    """The best strip of available sizes; its iterate may be inadmissible, if none is found."""
    explored = context.explored(starts[0])
    # The search for any admissible strip may have ended at sizes that are not to be had.
    explored.ends = [end for end in explored.ends if context.available(end.best.outcome.value.dimensions)]
    optimum = _optimum(explored, starts)
    if explored is context or optimum is None:
        return optimum
    context.ends = []
    local = at_full_accuracy(context, explored.ends, lambda d: _within(context, d))
    if local is None:
        return None
    conditions = None if local.found is None else _conditions(context, local)
    return Optimum(local, conditions, None, context.starts, len(explored.ends), optimum.left, optimum.followed)


def _optimum(context: Context, starts: Sequence[Dimensions]) -> Optimum | None:
    tried: set[tuple[float, ...]] = set()
    strip, *others = starts
    for other in others:
        _at(context, other, tried)
    for _ in range(_SHIFTS):
        found = _at(context, strip, tried)
        if found is None:
            break
        limits = context.core_limits_at(found.best.outcome.value.dimensions, found.best.outcome.value)
        proof = context.shifted_core(limits)
        if proof.best is None:
            _from_any_sizes(context, found, tried)
            break
        strip = proof.best.dimensions
        if _key(context, strip) in tried:
            break
    _settle(context, tried)
    best = context.best()
    if best is None:
        return None
    if best.found is None:
        return Optimum(best, starts=context.starts, ends=len(context.ends))
    left, followed = 0.0, None
    if context.model.rings:
        (_search_other_slices if context.sizes.stock_h is None else _search_lengths)(context, tried)
        left, followed = search_other_gaps(context, _within(context, context.best().best.outcome.value.dimensions))
    best = context.best()
    ends = len(context.ends)
    return Optimum(best, _conditions(context, best), None, context.starts, ends, left, followed)


def _search_other_slices(context: Context, tried: set[tuple[float, ...]]) -> None:
    """Slices of strips on paths over other gaps than the best strip's, and next to one that is better."""
    gaps = Gaps(context.task, context.bounds, apart=0.0)
    for _ in range(_SLICES):
        best = context.best()
        start = gaps.next(best.best, lambda d: _new(context, d, tried))
        if start is None:
            break
        found = _at(context, start, tried)
        while found is not None and found is context.best() and _improved(context, found, found, tried):
            found = context.best()


def _new(context: Context, d: Dimensions, tried: set[tuple[float, ...]]) -> bool:
    """Whether the slice that a strip lies in has not been tried, or from none as far between resonances."""
    x = logarithms(dimensions_within(_within(context, d), logarithms(d)))
    known = [*context.started, *(end.best.x for end in context.ends)]
    return _key(context, d) not in tried or all(np.max(np.abs(x - other)) > _ELSEWHERE for other in known)


def _search_lengths(context: Context, tried: set[tuple[float, ...]]) -> None:
    """Sizes next to lengths in other gaps that are about as good as the best strip; again from a better one of another
    width or thickness."""
    looked: set[tuple[float, float]] = set()
    for _ in range(_ROWS):
        best = context.best()
        d = best.best.outcome.value.dimensions
        if (d.b, d.h) in looked:
            return
        looked.add((d.b, d.h))
        for strip in promising_lengths(context, best.best):
            best = context.best()
            found = _at(context, strip, tried)
            if context.best() is not best or (found is not None and _improved(context, best, found, tried)):
                _settle(context, tried)


def _settle(context: Context, tried: set[tuple[float, ...]]) -> None:
    """Steps from the best strip on, as long as they better it."""
    best = context.best()
    while best is not None and _improved(context, best, best, tried):
        best = context.best()


def _conditions(context: Context, best: Local) -> Stationarity:
    narrow = context.sizes.around(best.best.outcome.value.dimensions)
    return conditions_at(context, best.best, context.bounds, narrow)


def _key(context: Context, d: Dimensions) -> tuple[float, ...]:
    """The sizes that are to be had, of the slice that a strip lies in."""
    near = context.sizes.around(d)
    return tuple(round(math.log(low), 9) if low == high else 0.0 for low, high in (near.b, near.h, near.l))


def _at(context: Context, strip: Dimensions, tried: set[tuple[float, ...]]) -> Local | None:
    """The end of a local search over what is free where a strip's other sizes are held."""
    tried.add(_key(context, strip))
    best = context.best()
    known = best.best.log_cost if context.model.rings and best is not None and best.found is not None else math.inf
    return context.search_from(strip, _within(context, strip), known=known)


def _within(context: Context, strip: Dimensions) -> Bounds:
    near = context.sizes.around(strip)
    return Bounds(near.b, near.h, (near.l[0], min(near.l[1], context.cycle.rod_length)))


def _from_any_sizes(context: Context, start: Local, tried: set[tuple[float, ...]]) -> None:
    """Sizes next to the best strip of sizes chosen at will: the way there would take many single steps."""
    free = local_search(context.model, context.task, context.bounds, start.best.x)
    if free is not None and free.found is not None:
        _improved(context, context.best(), free, tried)


def _improved(context: Context, best: Local, around: Local, tried: set[tuple[float, ...]]) -> bool:
    """Whether sizes next to a strip's are better than the best; in the order of what the corrected core says."""
    check = around.best.outcome.value
    limits = context.core_limits_at(check.dimensions, check)
    own, shift = best.best.log_cost if best.found is not None else math.inf, context.beyond_core(check.dimensions)
    promising = []
    for strip in _neighbours(context, check.dimensions):
        if _key(context, strip) in tried:
            continue
        expected = _expected(context, strip, check.dimensions, limits, shift)
        if expected is not None and expected[0] < own:
            promising.append(expected)
    promising.sort(key=lambda one: one[0])
    for _, strip in promising[:_MOST_LOOKED_AT]:
        _at(context, _between_same_resonances(context, strip, around.best), tried)
        if context.best() is not best:
            return True
    return False


def _between_same_resonances(context: Context, strip: Dimensions, other: Iterate) -> Dimensions:
    """The strip of a slice with another's frequency ratio, to first order, as the core knows no resonances; itself
    where nothing rings or no size is free."""
    near = _within(context, strip)
    free = [high > low for low, high in (near.b, near.h, near.l)]
    if not context.model.rings or not any(free):
        return strip
    x, slope = logarithms(strip), frequency_slopes(other.memory.active.home_cycle)
    way = np.where(free, slope, 0.0)
    return dimensions_within(near, x - way * float(slope @ (x - other.x)) / float(way @ way))


def _expected(
    context: Context, strip: Dimensions, around: Dimensions, limits: Limits, cost_shift: float
) -> tuple[float, Dimensions] | None:
    """The least ln objective that sizes may have by the corrected core, and its strip; None if inadmissible."""
    doubt = _WRONG * float(np.max(np.abs(logarithms(strip) - logarithms(around))))
    loose = {row: limit + doubt for row, limit in limits.items()}
    found = polish(context.cycle.coarse, context.problem.objective, loose, _within(context, strip), strip)
    if found is None:
        return None
    shift = 0.0 if context.problem.objective.per_density else doubt
    return found.log_cost - shift + cost_shift, found.dimensions


def _neighbours(context: Context, d: Dimensions) -> Iterator[Dimensions]:
    """Strips whose sizes are a few steps away from a strip's, within the bounds."""
    sizes, b = context.sizes, context.bounds
    lengths = _steps(d.l, sizes.step_l, b.l)
    for height in sizes.stock_near(d.h, _STEPS):
        # As wide as this one, or as stiff.
        stiff = min(max(d.b * (d.h / height) ** 3, b.b[0]), b.b[1])
        widths = {*_steps(d.b, sizes.step_b, b.b), *_steps(stiff, sizes.step_b, b.b)}
        for width, length in product(sorted(widths), lengths):
            yield Dimensions(width, height, length)


def _steps(size: float, step: float | None, within: tuple[float, float]) -> list[float]:
    if step is None:
        return [size]
    middle = round(size / step)
    sizes = [n * step for n in range(middle - _STEPS, middle + _STEPS + 1)]
    low, high = within
    return [min(max(s, low), high) for s in sizes if low * (1 - 1e-12) <= s <= high * (1 + 1e-12)]
