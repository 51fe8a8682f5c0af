"""Export files: waiting, caching, and failures reported once to the next request."""

from __future__ import annotations

import asyncio

import pytest

from app.errors import Problem
from app.exports.export import ExportOptions, File, Refusal
from app.jobs.errors import BudgetExceeded, SolveFailed
from app.run_exports import RunExports

RUN = {"id": "1", "kind": "crank-masses", "mode": "analysis", "status": "succeeded", "result": {"a": 1.0}}
MADE = File(b"made", "text/csv", "csv")


class Slow:
    """A slow executor that answers or fails, and counts its calls."""

    def __init__(self, answer, seconds=0.05):
        self.answer, self.seconds, self.asked = answer, seconds, 0

    async def run(self, *_):
        self.asked += 1
        await asyncio.sleep(self.seconds)
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


def twice(executor, first=0.0):
    """The result without waiting, and the result once the file is finished."""

    async def ask():
        exports = RunExports(executor, 1.0)
        try:
            before = await exports.file(RUN, "csv", ExportOptions(), first)
            await asyncio.sleep(0.2)
            return (
                before,
                await exports.file(RUN, "csv", ExportOptions(), 5.0),
                await exports.file(RUN, "csv", ExportOptions()),
            )
        finally:
            await exports.close()

    return asyncio.run(ask())


def test_a_slow_file_is_made_once():
    executor = Slow(MADE)
    assert twice(executor) == (None, MADE, MADE)
    assert executor.asked == 1


@pytest.mark.parametrize(
    ("failure", "status"),
    [(BudgetExceeded(1.0), 504), (SolveFailed("ValueError", "trace"), 500), (Refusal("/angle_deg", "no", "0"), 422)],
)
def test_a_failure_is_told_whether_one_waits_or_comes_again(failure, status):
    for first in (0.0, 5.0):
        with pytest.raises(Problem) as told:
            twice(Slow(failure), first)
        assert told.value.status == status
        assert "trace" not in str(told.value.body)


def test_two_requests_share_one_making():
    executor = Slow(MADE)

    async def both():
        exports = RunExports(executor, 1.0)
        return await asyncio.gather(*(exports.file(RUN, "csv", ExportOptions(), 5.0) for _ in range(2)))

    assert asyncio.run(both()) == [MADE, MADE]
    assert executor.asked == 1
