"""The flexible strip rod of a crank-slider machine.

from solvers import rod

scene = rod.Scene(rod.Mechanism(...), rod.Piston(...), rod.SchmidtLoad(...), rod.Material(...))
outcome = rod.check(scene, rod.Dimensions(b=9e-3, h=0.46e-3, l=23e-3))
"""

from solvers.effects import ALL, AUTO, EffectSelection
from solvers.materials import CATALOGUE, Material
from solvers.rod.bulk import Case, check_many
from solvers.rod.check import RodCheck, check
from solvers.rod.design import RodDesign, design
from solvers.rod.effects import EFFECTS, choose_for, compose
from solvers.rod.load.gas import ConstantLoad, SchmidtLoad, TableLoad
from solvers.rod.load.indicator import IndicatorLoad, mended
from solvers.rod.objectives import OBJECTIVES
from solvers.rod.problem import Bounds, Requirements, RodProblem
from solvers.rod.scene import Dimensions, Mechanism, Piston, Scene
from solvers.rod.verdict import judge

__all__ = [
    "ALL",
    "AUTO",
    "CATALOGUE",
    "EFFECTS",
    "OBJECTIVES",
    "Bounds",
    "Case",
    "ConstantLoad",
    "Dimensions",
    "EffectSelection",
    "IndicatorLoad",
    "Material",
    "Mechanism",
    "Piston",
    "Requirements",
    "RodCheck",
    "RodDesign",
    "RodProblem",
    "Scene",
    "SchmidtLoad",
    "TableLoad",
    "check",
    "check_many",
    "choose_for",
    "compose",
    "design",
    "judge",
    "mended",
]
