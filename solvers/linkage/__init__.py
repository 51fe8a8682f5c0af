"""The crank-rocker impact linkage: change-point four-bars whose rocker strikes once per crank revolution.

from solvers import linkage

scene = linkage.Scene(linkage.Restitution(0.3, 0.3), blow_frequency=25, impact_speed=5, impact_energy=2)
outcome = linkage.check(scene, linkage.of_ratio(scene, linkage.LARGEST_BASE, 3.0), linkage.Limits(joint_radius=5e-3))
"""

from solvers.effects import ALL, AUTO, EffectSelection
from solvers.linkage.bulk import Case, check_many
from solvers.linkage.check import check, of_ratio
from solvers.linkage.design import LinkageDesign, design
from solvers.linkage.effects import EFFECTS
from solvers.linkage.limits import Limits, demands_of
from solvers.linkage.mechanism.change_point import KINDS, LARGEST_BASE, LARGEST_COUPLER, LARGEST_ROCKER
from solvers.linkage.mechanism.lengths import Lengths, Mechanism, of_lengths
from solvers.linkage.pareto_front import AGAINST, MOST_POINTS, FrontPoint, front
from solvers.linkage.problem import OBJECTIVES, LinkageProblem
from solvers.linkage.result import LinkageCheck
from solvers.linkage.scene import Drive, Restitution, Scene
from solvers.linkage.verdict import Given, judge

__all__ = [
    "AGAINST",
    "ALL",
    "AUTO",
    "EFFECTS",
    "KINDS",
    "LARGEST_BASE",
    "LARGEST_COUPLER",
    "LARGEST_ROCKER",
    "MOST_POINTS",
    "OBJECTIVES",
    "Case",
    "Drive",
    "EffectSelection",
    "FrontPoint",
    "Given",
    "Lengths",
    "Limits",
    "LinkageCheck",
    "LinkageDesign",
    "LinkageProblem",
    "Mechanism",
    "Restitution",
    "Scene",
    "check",
    "check_many",
    "demands_of",
    "design",
    "front",
    "judge",
    "of_lengths",
    "of_ratio",
]
