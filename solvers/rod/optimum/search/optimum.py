"""Results of a search for the optimum on the full model."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.numerics.arrays import Array
from solvers.rod.optimum.search.local_search import LocalResult
from solvers.rod.optimum.sensitivities import Stationarity


@dataclass(frozen=True)
class SecondOrder:
    """The least curvature of the Lagrangian along the directions that limits leave free (None if there are none), the
    gain in ln objective predicted by a quadratic model within the step bounds, and the predicted steps in ln(b, h, l).
    """

    curvature: float | None
    predicted_gain: float
    steps: tuple[Array, ...]


@dataclass
class Optimum:
    """The best result of all local searches."""

    local: LocalResult
    conditions: Stationarity | None = None
    second_order: SecondOrder | None = None
    remaining_gain: float = 0.0
    """Estimate of the gain in ln objective in other gaps between resonances, if the search there was cut short."""
    ratio_range: tuple[float, float] | None = None
    """Minimum and maximum frequency ratio of the gaps searched; None without resonances."""
