"""Order of compilation: rehearsals wait for entries, so that nothing is compiled twice."""

from __future__ import annotations

import itertools
import time
from collections import deque

import pytest

from app.designs.rehearsals import FIRST_RUN
from app.jobs.compiling import Unit
from app.jobs.fork_server import ForkServer
from app.jobs.warming import KernelWarming, _Progress, _Task

ROD, CHECK, PIN = ("flexible-rod", "design"), ("flexible-rod", "check"), ("pin-profile", "design")
A, B, C = (Unit(((name, "f"),), frozenset({name})) for name in "abc")


def test_only_rehearsals_wait_and_only_for_entries_ahead_of_them() -> None:
    warming = KernelWarming(ForkServer("never started"))
    warming._parts = {ROD: _Progress("waiting"), PIN: _Progress("waiting")}
    warming._waiting.extend([_Task(ROD, A), _Task(ROD, B), _Task(ROD), _Task(PIN, C), _Task(PIN)])
    taken = [warming._next_task(set()) for _ in range(3)]
    # The rod's rehearsals wait for its entries; meanwhile the next kind's are compiled.
    assert taken == [_Task(ROD, A), _Task(ROD, B), _Task(PIN, C)]
    warming._running.remove(_Task(ROD, A))
    warming._running.remove(_Task(ROD, B))
    assert warming._next_task(set()) == _Task(ROD)
    warming._running.remove(_Task(PIN, C))
    assert warming._next_task(set()) == _Task(PIN)
    assert warming._next_task(set()) is None


def test_the_first_run_its_pictures_and_its_files_wait_for_their_own_kernels_only() -> None:
    warming = KernelWarming(ForkServer("never started"))
    warming._parts = {FIRST_RUN: _Progress("compiling"), CHECK: _Progress("waiting"), ROD: _Progress("waiting")}
    asked = (FIRST_RUN[1], "picture:stability-map", "export:pdf", "check", "design", "accuracy")
    assert not any(warming.is_warm("flexible-rod", mode) for mode in asked)
    warming._parts[FIRST_RUN].state = "warm"
    assert [warming.is_warm("flexible-rod", mode) for mode in asked] == [True, True, True, False, False, False]
    warming._parts[CHECK].state, warming._parts[ROD].state = "warm", "failed"
    assert all(warming.is_warm("flexible-rod", mode) for mode in asked)


def test_a_process_goes_on_with_units_whose_kernels_it_has_compiled_and_others_have_not() -> None:
    far = Unit((("far", "f"),), frozenset({"far", "others", "new"}))
    near = Unit((("near", "f"),), frozenset({"near", "own"}))
    warming = KernelWarming(ForkServer("never started"))
    warming._parts = {ROD: _Progress("waiting"), PIN: _Progress("waiting")}
    warming._compiled = {"own", "others"}
    warming._waiting.extend([_Task(ROD, far), _Task(ROD, near), _Task(ROD), _Task(PIN, Unit((), frozenset({"own"})))])
    assert warming._next_task({"own"}) == _Task(ROD, near)
    assert warming._next_task({"own"}) == _Task(ROD, far)


def test_time_left_counts_the_code_of_all_kernels_up_to_the_kind() -> None:
    warming = KernelWarming(ForkServer("never started"))
    warming._parts = {ROD: _Progress("compiling"), PIN: _Progress("waiting")}
    warming._sizes = {"flexible-rod": {"small": 100_000, "large": 900_000}, "pin-profile": {"pin": 1_000_000}}
    warming._compiled = {"small"}
    warming._finished = [frozenset({"small"})]
    large, pin = Unit((), frozenset({"small", "large"})), Unit((), frozenset({"pin"}))
    warming._running, warming._waiting = [_Task(ROD, large)], deque([_Task(ROD), _Task(PIN, pin), _Task(PIN)])
    warming._began = time.monotonic() - 20.0
    # Half of the rod's kernels are compiled, but a tenth of the code: 21.2 s for 260,000 bytes, the prior included.
    assert warming.status("flexible-rod").remaining_s == pytest.approx(21.2 * 2.35 / 0.26, rel=0.01)
    assert warming.status("pin-profile").remaining_s == pytest.approx(21.2 * 4.85 / 0.26, rel=0.01)


@pytest.mark.parametrize("pace", [3e-5, 1.2e-4, 1e-3])
def test_the_time_left_does_not_rise_at_a_constant_pace(monkeypatch: pytest.MonkeyPatch, pace: float) -> None:
    """On machines four times as fast as expected to eight times as slow; a third of the kernels is never compiled."""
    sizes = {f"k{i}": 200 * (i % 17 + 1) for i in range(150)}
    units = [Unit((), frozenset({f"k{3 * i}", f"k{3 * i + 1}"})) for i in range(50)]
    warming = KernelWarming(ForkServer("never started"))
    warming._parts, warming._sizes = {ROD: _Progress("compiling")}, {"flexible-rod": sizes}
    warming._waiting = deque([*(_Task(ROD, unit) for unit in units), _Task(ROD)])
    now, total = 0.0, pace * 2.5 * sum(sizes[name] for unit in units for name in unit.kernels)
    warming._began = 0.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    shown = []
    for unit in units:
        for name in sorted(unit.kernels):
            now += 1.5 * pace * sizes[name]
            warming._compiled.add(name)
            shown.append((now, warming.status("flexible-rod").remaining_s))
        now += pace * sum(sizes[name] for name in unit.kernels)
        warming._waiting.popleft()
        warming._finished.append(unit.kernels)
        shown.append((now, warming.status("flexible-rod").remaining_s))
    late = [(at, left) for at, left in shown if 0.08 * total < at < 0.95 * total]
    assert len(late) > 100
    assert all(0.75 < left / (total - at) < 2.0 for at, left in late)
    assert all(left < 1.1 * before for (_, before), (_, left) in itertools.pairwise(late))
    assert max(left for _, left in late) < 1.1 * late[0][1]
