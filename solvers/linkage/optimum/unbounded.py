"""Objectives that improve indefinitely with longer links: no optimum exists, and the missing limit is reported.

With a tool at its own radius the blow frequency is v/(2 pi r |u31(2 pi)|), and |u31(2 pi)| = (g + 1)/e tends to 0 as
the base, and with it e, grows without bound: the largest rocker for lambda2 -> g^2, the largest base for lambda0 ->
inf. The transmission angle then tends to 2 asin(1/g), and in crank lengths all dimensions of the swept area except its
length along the base converge. So if a sufficiently distant member is feasible, all members beyond it are feasible too,
each better than the one before.
"""

from __future__ import annotations

import numpy as np

from solvers.errors import InvalidInput
from solvers.linkage.optimum.family import Family
from solvers.linkage.optimum.member_quantities import MemberQuantities
from solvers.linkage.problem import LinkageProblem

_VANISHING = 1e-3
"""|u31(2 pi)| at an end of the family below which the base is assumed to grow without bound toward that end."""


def refuse_unbounded(problem: LinkageProblem) -> None:
    """Raise InvalidInput if longer links improve the objective indefinitely."""
    limits = problem.limits
    if not problem.objective.improves_with_lower_u31_end or problem.scene.tool_radius is None:
        return
    if limits.longest_link is not None or limits.enclosing_radius is not None:
        return
    if limits.width is not None and limits.height is not None:
        return
    for kind in problem.kinds:
        family = Family(kind, problem.scene.restitution.gain)
        ends = MemberQuantities(problem, family, np.array(family.proof_range))
        if np.any((ends.u31_end_low < _VANISHING) & np.less(*ends.scale)):
            raise InvalidInput(
                "limits.longest_link",
                f"the longer the links of the {kind.name.replace('_', ' ')} the higher the blow frequency at this tool "
                "radius, without end",
                "a limit on the longest link, the enclosing radius, or both width and height",
            )
