"""In which order two processes compile: rehearsals wait for what they would otherwise compile a second time."""

from __future__ import annotations

from app.jobs.template import Template
from app.jobs.warming import KernelWarming, _Progress, _Step

ROD, PIN = ("flexible-rod", "design"), ("pin-profile", "design")
A, B, C = (("a", "f"),), (("b", "f"),), (("c", "f"),)


def test_rehearsals_wait_for_the_entries_ahead_of_them_and_nothing_else_does() -> None:
    warming = KernelWarming(Template("never started"))
    warming._parts = {ROD: _Progress("waiting"), PIN: _Progress("waiting")}
    warming._waiting.extend([_Step(ROD, A), _Step(ROD, B), _Step(ROD), _Step(PIN, C), _Step(PIN)])
    taken = [warming._next() for _ in range(3)]
    # The rod's rehearsals wait for its entries; meanwhile the next kind's are compiled.
    assert taken == [_Step(ROD, A), _Step(ROD, B), _Step(PIN, C)]
    warming._running.remove(_Step(ROD, A))
    warming._running.remove(_Step(ROD, B))
    assert warming._next() == _Step(ROD)
    warming._running.remove(_Step(PIN, C))
    assert warming._next() == _Step(PIN)
    assert warming._next() is None
