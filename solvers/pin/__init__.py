"""Piston pin: the lightest bore for a given outer diameter. Bushing: the lightest outer profile for a given bore.

from solvers import pin

scene = pin.Scene(pin.Geometry(...), force, pin.PinMaterial(...))
outcome = pin.design(pin.PinProblem(scene))

A bushing uses the same interface with a ``pin.BushingGeometry``.
"""

from solvers.effects import ALL, AUTO, EffectSelection
from solvers.pin.bulk import PinTable, check_bores, check_many
from solvers.pin.check import Case, check
from solvers.pin.design import PinDesign, design, explain
from solvers.pin.effects import EFFECTS
from solvers.pin.load.macaulay import LoadCase, MacaulayTerm
from solvers.pin.materials import CATALOGUE, PinSteel
from solvers.pin.optimum.capacity import Diagnosis, force_limit
from solvers.pin.problem import PinProblem
from solvers.pin.result import PinCheck, Stress
from solvers.pin.scene import BushingGeometry, Geometry, Limits, PinMaterial, Scene
from solvers.pin.section.criteria import CRITERIA
from solvers.pin.shapes.cone import Cone
from solvers.pin.shapes.constant import Constant
from solvers.pin.shapes.free import Free, free_sizes
from solvers.pin.shapes.given import Profile
from solvers.pin.shapes.stepped import Stepped
from solvers.pin.verdict import judge

__all__ = [
    "ALL",
    "AUTO",
    "CATALOGUE",
    "CRITERIA",
    "EFFECTS",
    "BushingGeometry",
    "Case",
    "Cone",
    "Constant",
    "Diagnosis",
    "EffectSelection",
    "Free",
    "Geometry",
    "Limits",
    "LoadCase",
    "MacaulayTerm",
    "PinCheck",
    "PinDesign",
    "PinMaterial",
    "PinProblem",
    "PinSteel",
    "PinTable",
    "Profile",
    "Scene",
    "Stepped",
    "Stress",
    "check",
    "check_bores",
    "check_many",
    "design",
    "explain",
    "force_limit",
    "free_sizes",
    "judge",
]
