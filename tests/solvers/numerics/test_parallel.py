"""Rows divided among threads."""

from __future__ import annotations

import pytest

from solvers.numerics.parallel import in_slices


@pytest.mark.parametrize("threads", [1, 2, 7])
@pytest.mark.parametrize("count", [0, 1, 5, 23])
def test_every_row_is_solved_once_and_in_order(count, threads):
    rows = list(range(count))
    found = in_slices(lambda part: rows[part], count, threads)
    assert [row for part in found for row in part] == rows
    assert len(found) == max(min(count, threads), 1)
