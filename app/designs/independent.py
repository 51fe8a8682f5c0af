"""Helpers for the independent references of the kinds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from app.designs.kind import Answer
from app.designs.units import in_si
from solvers.accuracy import Exact, Reference

ROUNDING = 2.0**-52
"""Relative rounding error of a unit conversion."""

Found = Mapping[str, tuple[Any, float]]
"""name -> (mpmath value in SI units or None, its relative uncertainty)"""


def active(answer: Answer) -> frozenset[str]:
    """Names of the effects that were computed."""
    return frozenset(effect["name"] for effect in answer.effects if effect["state"] == "active")


def exact(found: Found, names: Mapping[str, str]) -> dict[str, Exact]:
    """Results by the API's names, in its units; ``names`` gives each one's name."""
    results_by_name = {}
    for own, name in names.items():
        if own in found:
            value, doubt = found[own]
            unit = in_si(name.partition(".")[0])[1]
            results_by_name[name] = Exact(None if value is None else float(value / unit), doubt + ROUNDING)
    return results_by_name


def reference(made: str, results: Callable[[Callable[[], None]], dict[str, Exact]]) -> Reference:
    """A reference in arbitrary precision; ``made`` describes its equations."""
    return Reference(f"in arbitrary precision, {made}", results)
