"""A problem on the full model, with the local searches made so far."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from solvers.numerics.arrays import Array
from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.check import RodCheck
from solvers.rod.constraints import Limits
from solvers.rod.optimum.core.cycle import CoreCycle
from solvers.rod.optimum.core.local_optimum import dimensions_within
from solvers.rod.optimum.full_model.model import FullModel
from solvers.rod.optimum.full_model.strip import logarithms
from solvers.rod.optimum.search.earlier_search import EarlierSearch
from solvers.rod.optimum.search.local_search import LocalResult, Task, is_among, local_search
from solvers.rod.optimum.search.optimum import Optimum
from solvers.rod.optimum.sizes import Sizes
from solvers.rod.problem import Bounds, RodProblem
from solvers.rod.scene import Dimensions
from solvers.watch import no_watch

_REPEATED_RADIUS = 0.01
"""First radius, in ln b, ln h, ln l, of a search from what an earlier one has found."""
_COARSE_ACCURACY, _MAX_COARSE_ACCURACY = 1e-4, 1e-3
"""Accuracy of all searches but the last with resonances, and its maximum if no check attains it."""


class OtherEffects(Exception):
    """The strip found calls for other effects than those in use."""

    def __init__(self, strip: Dimensions) -> None:
        self.strip = strip


class Sufficient(Exception):
    """A strip was found whose check suffices, so that the best one is not searched for."""

    def __init__(self, strip: Dimensions) -> None:
        self.strip = strip


Suffices = Callable[[Outcome[RodCheck]], bool]
"""Whether a feasible strip with this check ends the search."""


def never(found: Outcome[RodCheck]) -> bool:
    """No check suffices: the best strip is searched for."""
    return False


def keep_effects(local: LocalResult) -> None:
    """Search on, whatever strip was found."""


@dataclass
class Context:
    """A problem with its core, its full model, and the searches so far.

    ``confirm_effects`` is called with the first optimum, before other gaps between resonances are searched, and may
    raise ``OtherEffects``: most of the time is spent on these gaps. The first feasible result whose check ``suffices``
    ends the search by ``Sufficient``.
    """

    problem: RodProblem
    cycle: CoreCycle
    model: FullModel
    task: Task
    sizes: Sizes
    results: list[LocalResult] = field(default_factory=list)
    start_points: list[Array] = field(default_factory=list)
    confirm_effects: Callable[[LocalResult], None] = keep_effects
    suffices: Suffices = never
    coarse: Context | None = None
    """The same problem at lower accuracy: with resonances all searches but the last are made there."""
    earlier: EarlierSearch | None = None
    """The search of the same problem with slightly different effects."""

    @property
    def search_count(self) -> int:
        """Number of local searches."""
        return len(self.start_points)

    @property
    def local_optima_count(self) -> int:
        """Number of different strips that the searches have found; with resonances searches at full accuracy only
        refine the others' results."""
        found: list[LocalResult] = []
        for result in (self.coarse or self).results:
            if not is_among(result.at.x, found):
                found.append(result)
        return len(found)

    def search_from(
        self, start: Dimensions, bounds: Bounds, radius: float = 0.15, max_iterations: int | None = None,
        incumbent: float = math.inf,
    ) -> LocalResult | None:  # fmt: skip
        """Run a local search and store its result; it is abandoned if it is not expected to improve on the ln objective
        ``incumbent``."""
        self.start_points.append(logarithms(start))
        # Without resonances there are few searches, which are to confirm each other's results.
        others, x = self.results if self.model.has_resonances else (), logarithms(start)
        local = local_search(self.model, self.task, bounds, x, radius, max_iterations, incumbent, others)
        if local is not None:
            self.results.append(local)
            if local.feasible and self.suffices(local.at.outcome):
                raise Sufficient(local.at.dimensions)
        return local

    def search_again(self) -> bool:
        """Search from the strips that the earlier search has found, each within its slice of discrete sizes; returns
        whether there is a feasible result."""
        for start in self.earlier.starts():
            strip = start.at.dimensions
            self.search_from(strip, self.sizes.around(strip), _REPEATED_RADIUS, incumbent=self.incumbent)
        return any(result.feasible for result in self.results)

    def exploratory(self, start: Dimensions) -> Context:
        """The context for searches from a strip: with resonances one of low accuracy, or of the accuracy attainable by
        checks there, because higher accuracy only pays in the last steps."""
        if not self.model.has_resonances:
            return self
        model = self.model.coarser(_COARSE_ACCURACY)
        estimated = model.check(dimensions_within(self.sizes.bounds, logarithms(start))).accuracy.estimated
        if estimated > model.accuracy and not model.is_excited_by_corners:
            model = model.at_accuracy(min(estimated, _MAX_COARSE_ACCURACY))
        factor = model.accuracy / self.model.accuracy
        task = replace(self.task, margin=factor * self.task.margin, min_gain=factor * self.task.min_gain)
        self.coarse = replace(self, model=model, task=task, results=[])
        return self.coarse

    def finer(self, strip: Dimensions) -> Context:
        """This context with the fine model. Under a noisy load the strips of its stencils must be exact, too, unless
        the error of checks, such as that of the given strip, exceeds the accuracy."""
        noisy = self.model.is_excited_by_corners
        exact = noisy and self.model.check(strip).accuracy.estimated <= self.model.accuracy
        return replace(self, model=self.model.finer(None if exact else self.coarse.model), results=[])

    def best(self) -> LocalResult | None:
        """The best result: feasible before infeasible, then by cost."""
        key = lambda local: (local.at.excess, local.at.log_cost)  # noqa: E731
        return min(self.results, key=key, default=None)

    @property
    def incumbent(self) -> float:
        """The ln objective of the best feasible result; inf without one."""
        return min((result.at.log_cost for result in self.results if result.feasible), default=math.inf)

    def feasible_checks(self) -> list[Outcome[RodCheck]]:
        """Checks of available sizes that meet every requirement: the exact ones, or without any the coarse ones."""
        p = self.problem
        checks = (o for o in self.model.all_checks() if p.requirements.met_by(o.value))
        feasible = [o for o in checks if self.available(o.value.dimensions)]
        return feasible if feasible or self.coarse is None else self.coarse.feasible_checks()

    def available(self, d: Dimensions) -> bool:
        """Whether a strip's sizes are available."""
        nearest = self.sizes.around(d)
        limits = zip((d.b, d.h, d.l), (nearest.b, nearest.h, nearest.l), strict=True)
        return all(low <= size <= high for size, (low, high) in limits)

    def best_so_far(self) -> Optimum | None:
        """The best feasible strip checked so far, when the search ends early; None if there is none."""
        self.model.watch = no_watch
        for known in sorted(self.feasible_checks(), key=lambda outcome: self.task.cost(outcome.value)):
            outcome = self.model.check(known.value.dimensions)
            if self.problem.requirements.met_by(outcome.value):
                return Optimum(LocalResult(self.task.iterate(outcome), math.inf))
        return None

    def corrected_core_limits(self, check: RodCheck, margin: float = 0.0) -> Limits:
        """The limits for the core, shifted by the difference of its rows from the full model's at a checked strip and
        tightened by ``margin``."""
        limits = self.task.shifted_limits(check, self.cycle.rows(check.dimensions, self.model.required))
        limits = {row: limit - margin for row, limit in limits.items()}
        limits[rows.STABILITY] = min(limits[rows.STABILITY], -1e-9)
        return limits

    def objective_correction(self, check: RodCheck) -> float:
        """Difference of ln objective between full model and core at a checked strip."""
        objective, exact = self.problem.objective, self.task.cost(check)
        if objective.is_geometric or not math.isfinite(exact):
            return 0.0
        values = self.cycle.rows(check.dimensions, self.model.required)
        return exact - sum(weight * values[row] for row, weight in objective.weights)
