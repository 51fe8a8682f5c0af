"""What the searches of a problem have found."""

from __future__ import annotations

import numpy as np

from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.local_search import SAME_STRIP, Iterate, LocalResult


def result_at(x):
    return LocalResult(Iterate(np.asarray(x), None, 0.0, 0.0, None, {}), 0.0)


def context(results, coarse=None):
    return Context(None, None, None, None, None, results=[result_at(x) for x in results], coarse=coarse)


def test_a_strip_found_by_two_searches_is_one_local_optimum():
    first, second = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0 + 2 * SAME_STRIP])
    assert context([first, second, first + 0.5 * SAME_STRIP, second]).local_optima_count == 2


def test_refined_results_are_not_counted_again():
    strip = np.array([0.0, 1.0, 2.0])
    assert context([strip + 2 * SAME_STRIP], coarse=context([strip])).local_optima_count == 1
