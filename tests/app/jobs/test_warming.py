"""Order of compilation: rehearsals wait for entries, so that nothing is compiled twice."""

from __future__ import annotations

from app.jobs.fork_server import ForkServer
from app.jobs.warming import KernelWarming, _Progress, _Task

ROD, PIN = ("flexible-rod", "design"), ("pin-profile", "design")
A, B, C = (("a", "f"),), (("b", "f"),), (("c", "f"),)


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


def test_a_process_goes_on_with_modules_it_has_compiled_kernels_of() -> None:
    near, far = (("own.near", "f"), ("new.near", "f")), (("other.far", "f"), ("own.far", "f"), ("new.far", "f"))
    warming = KernelWarming(ForkServer("never started"))
    warming._parts = {ROD: _Progress("waiting"), PIN: _Progress("waiting")}
    warming._waiting.extend([_Task(ROD, far), _Task(ROD, near), _Task(ROD), _Task(PIN, (("own.pin", "f"),))])
    assert warming._next_task({"own"}) == _Task(ROD, near)
    assert warming._next_task({"own"}) == _Task(ROD, far)
