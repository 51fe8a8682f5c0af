"""A quarry: a bounded space of scenes, each a case in the format of the wing's file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mpmath as mp
import numpy as np


@dataclass(frozen=True)
class Quarry:
    """``case`` maps a point of the unit cube to a case, None if it is no valid scene; ``judge`` yields the name of
    every value with its error in eps max(1, kappa)."""

    wing: str
    group: str
    stem: str
    dimensions: int
    case: Callable[[np.ndarray], dict | None]
    judge: Callable[[dict], Iterator[tuple[str, float]]]


def between(share: float, low: float, high: float) -> float:
    return float(low + (high - low) * share)


def power(share: float, low: float, high: float) -> float:
    """10^low to 10^high, evenly in the exponent."""
    return float(10.0 ** between(share, low, high))


def pick(share: float, *choices):
    return choices[min(int(share * len(choices)), len(choices) - 1)]


def entries(found) -> dict:
    """name -> (value, condition) as in the files of references."""
    return {
        name: {"value": mp.nstr(value, 30), "condition": float(mp.nstr(kappa, 6))}
        for name, (value, kappa) in found.items()
    }
