"""The flexible strip rod of a crank-slider machine.

from solvers import rod

scene = rod.Scene(rod.Mechanism(...), rod.Piston(...), rod.SchmidtLoad(...), rod.Material(...))
outcome = rod.check(scene, rod.Dimensions(b=9e-3, h=0.46e-3, l=23e-3))
"""

from solvers.effects import ALL, AUTO, EffectSelection
from solvers.materials import CATALOGUE, Material
from solvers.rod.check import RodCheck, check
from solvers.rod.effects import EFFECTS
from solvers.rod.loads import ConstantLoad, SchmidtLoad, TableLoad
from solvers.rod.scene import Dimensions, Mechanism, Piston, Scene

__all__ = [
    "ALL",
    "AUTO",
    "CATALOGUE",
    "EFFECTS",
    "ConstantLoad",
    "Dimensions",
    "EffectSelection",
    "Material",
    "Mechanism",
    "Piston",
    "RodCheck",
    "Scene",
    "SchmidtLoad",
    "TableLoad",
    "check",
]
