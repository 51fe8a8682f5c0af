"""Independent references of the kinds, and what they share: which effects an answer had, and units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from app.designs.kind import Answer
from solvers.accuracy import Exact, Reference

ROUNDING = 2.0**-52
"""What a result loses as a float, in another unit."""

Found = Mapping[str, tuple[Any, float]]
"""name -> (value of mpmath in SI units or None, what it may be off, relative)."""


def active(answer: Answer) -> frozenset[str]:
    """The effects that ran."""
    return frozenset(effect["name"] for effect in answer.effects if effect["state"] == "active")


def exact(found: Found, names: Mapping[str, tuple[str, float]]) -> dict[str, Exact]:
    """Results by the contract's names: ``names`` says what each is called and its unit in SI."""
    told = {}
    for own, (name, unit) in names.items():
        if own in found:
            value, doubt = found[own]
            told[name] = Exact(None if value is None else float(value / unit), doubt + ROUNDING)
    return told


def reference(made: str, results: Callable[[Callable[[], None]], dict[str, Exact]]) -> Reference:
    """A reference in arbitrary precision; ``made`` says by which equations."""
    return Reference(f"in arbitrary precision, {made}", results)
