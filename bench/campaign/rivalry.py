"""What a random design problem of a kind tells a campaign, and how its rivals are put to the check."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from app.designs.kind import Answer

Body = dict[str, Any]
Check = Callable[[Body], Body | None]
"""From a check request, with the answer's own effects, to the checked result; None where it has none."""


class Problem(Protocol):
    """A random design problem, and how other ways of solving it are told."""

    @property
    def body(self) -> Body:
        """The design request."""

    @property
    def sign(self) -> int:
        """+1 where the objective is made small, -1 where it is made great."""

    def objective(self, result: Body) -> float | None:
        """What is wanted, of a checked result or a design's."""

    def given(self, answer: Answer) -> Body | None:
        """The check request of a design's answer; None where no check can be told of it to all digits."""

    def rivals(self, rng: np.random.Generator, answer: Answer, check: Check) -> None:
        """Put what the form and the bounds allow to the check; each counts if it keeps the limits."""

    def broken(self, result: Body) -> float:
        """By what share the worst of the limits is missed; 0 where all are kept."""


def excess(value: float | None, limit: float | None) -> float:
    """By what share a value exceeds its limit; nothing does where none of the two is asked."""
    if limit is None or value is None:
        return 0.0
    return max(value / limit - 1.0, 0.0) if limit > 0 else (0.0 if value <= 0 else math.inf)
