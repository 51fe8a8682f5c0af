"""Composition of a design's outcome: the optimal strip with its certificate, or the diagnosis of infeasibility."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from solvers.outcome import Accuracy, ActiveConstraint, Certificate, Outcome, Status
from solvers.rod.check import RodCheck
from solvers.rod.constraints import BY_NAME, Limits
from solvers.rod.optimum.answer import certificate
from solvers.rod.optimum.answer.core_requirement import CoreOptima
from solvers.rod.optimum.answer.infeasibility import diagnose
from solvers.rod.optimum.answer.requirement_as_objective import RequirementsAsObjectives
from solvers.rod.optimum.answer.result import RodDesign
from solvers.rod.optimum.core.local_optimum import Polished
from solvers.rod.optimum.full_model.strip import logarithms
from solvers.rod.optimum.peaks import ANGLES
from solvers.rod.optimum.proof.outer_approximation import MAX_BOXES, Proof
from solvers.rod.optimum.search.context import Context
from solvers.rod.optimum.search.costly_limits import objective_error
from solvers.rod.optimum.search.optimum import Optimum
from solvers.rod.optimum.sensitivities import stationarity
from solvers.rod.scene import Dimensions

_INFLUENCE_FRACTION = 0.1
"""Accuracy of attainable values on the core, as a fraction of the influence of effects beyond the core."""


@dataclass(frozen=True)
class Answers:
    """Data of a problem common to all kinds of outcome.

    context       the searches on the full model
    accuracy      the accuracy asked for
    slack         by how much the problem's requirements are relaxed
    influence     sum of the bounds of the named effects at a strip
    out_of_time   whether the time budget ended the search
    """

    context: Context
    accuracy: float
    slack: float
    influence: Callable[[Dimensions, tuple[str, ...]], float]
    out_of_time: bool

    def of_core(self, proof: Proof, best: Polished, outcome: Outcome[RodCheck], limits: Limits) -> Outcome[RodDesign]:
        """Outcome if no effect goes beyond the core; ``limits`` are those of the search."""
        p, result = self.context.problem, outcome.value
        x = logarithms(best.dimensions)
        conditions = stationarity(
            best.active.values(x), best.active.jacobian(x), best.active.layout, p.objective, limits,
            self.context.sizes, result.dimensions,
        )  # fmt: skip
        value, cost = p.objective.read(result), p.objective.log_cost(result, p.scene)
        # The bound is inexact by the shift of the search's limits and by the error of its objective value.
        gap = certificate.cost_of_shifts(
            {row: limits[row] - self.context.task.limits[row] for row in limits}, conditions.active
        )
        if math.isfinite(cost):
            gap += max(cost - proof.log_bound, 0.0) + abs(cost - best.log_cost)
        statement = certificate.core_certificate(p.objective, value, proof, gap)
        estimated = max(outcome.accuracy.estimated, statement.gap)
        return self._succeeded(outcome, conditions.active, estimated, statement)

    def of_full_model(self, proof: Proof, beyond: tuple[str, ...], optimum: Optimum) -> Outcome[RodDesign]:
        """Outcome for the best strip on the full model."""
        context, best, conditions = self.context, optimum.local.at, optimum.conditions
        active = () if conditions is None else conditions.active
        relaxed, influence = certificate.relaxed_bound(
            context, proof, best.dimensions, lambda d: self.influence(d, beyond)
        )
        statement = certificate.full_certificate(context, proof, relaxed, influence, beyond, optimum)
        estimated = objective_error(context, optimum)
        at_vertex = conditions is not None and not len(conditions.tangent) and not context.sizes.discrete
        if context.model.is_lightly_damped and not at_vertex:
            # A neighbouring narrow valley may be deeper.
            estimated = math.inf
        if not math.isfinite(estimated):
            # Only the distance from the lower bound is known.
            estimated = min(statement.gap, 1.0)
        return self._succeeded(best.outcome, active, estimated, statement)

    def infeasible(
        self, attainable: RequirementsAsObjectives, proof: Proof, strip: Dimensions,
        beyond: tuple[str, ...], nearest: Optimum | None,
    ) -> Outcome[RodDesign]:  # fmt: skip
        """Outcome of an infeasible problem: proven on the core, on the full model based on searches only."""
        context, excess = self.context, math.inf
        limits = context.task.limits
        if nearest is not None:
            check, excess = nearest.local.at.outcome.value, nearest.local.at.excess
            limits = context.corrected_core_limits(check)
        influence = self.influence(strip, beyond)
        core = CoreOptima(
            context.cycle, context.sizes, context.problem.scene, max(self.accuracy, _INFLUENCE_FRACTION * influence)
        )
        entries, error = diagnose(core, limits, attainable, context.model, influence)
        statement = certificate.infeasible_certificate(proof, beyond, context.search_count, excess)
        accuracy = Accuracy(self.accuracy, min(error, 1.0), {"angles": ANGLES})
        return Outcome(Status.INFEASIBLE, None, (), accuracy, certificate=statement, diagnosis=entries)

    def failed(self) -> Outcome[RodDesign]:
        """Outcome if the time ran out before an admissible strip was found or infeasibility was shown."""
        accuracy = Accuracy(self.accuracy, 1.0, {"angles": ANGLES})
        return Outcome(Status.FAILED, None, (), accuracy)

    def _succeeded(
        self,
        found: Outcome[RodCheck],
        active: tuple[ActiveConstraint, ...],
        estimated: float,
        statement: Certificate,
    ) -> Outcome[RodDesign]:
        check = found.value
        if self.slack > 0.0:
            warning = "the requirements leave no room: they are met to within the accuracy"
            check = replace(check, warnings=(*check.warnings, warning))
            estimated += self.slack * sum(abs(a.sensitivity) for a in active if a.name in BY_NAME)
        if self.out_of_time:
            warning = "the time budget ended the search: this is the best feasible strip found so far"
            check = replace(check, warnings=(*check.warnings, warning))
        return Outcome(
            Status.SUCCEEDED,
            RodDesign(check, self.context.problem.objective.name, active, found.accuracy.estimated),
            (),
            Accuracy(self.accuracy, estimated, {"angles": ANGLES, "boxes": MAX_BOXES}),
            certificate=statement,
        )
