"""The piston pin: the lightest bore for a given outer diameter.

from solvers import pin

scene = pin.Scene(pin.Geometry(...), force, pin.PinMaterial(...))
outcome = pin.design(pin.PinProblem(scene))
"""

from solvers.effects import ALL, AUTO, EffectSelection
from solvers.pin.capacity import force_limit
from solvers.pin.check import PinCheck, check
from solvers.pin.cones import Cone
from solvers.pin.design import PinDesign, PinProblem, design, explain
from solvers.pin.diagnosis import Diagnosis
from solvers.pin.effects import EFFECTS
from solvers.pin.family import LoadProfile, free_bores, load_sweep
from solvers.pin.loads import LoadCase, MacaulayTerm
from solvers.pin.materials import CATALOGUE, PinSteel
from solvers.pin.pointwise import Constant, Free
from solvers.pin.profile import Profile
from solvers.pin.scene import Geometry, Limits, PinMaterial, Scene
from solvers.pin.section import CRITERIA
from solvers.pin.stepped import Stepped
from solvers.pin.verdict import judge

__all__ = [
    "ALL",
    "AUTO",
    "CATALOGUE",
    "CRITERIA",
    "EFFECTS",
    "Cone",
    "Constant",
    "Diagnosis",
    "EffectSelection",
    "Free",
    "Geometry",
    "Limits",
    "LoadCase",
    "LoadProfile",
    "MacaulayTerm",
    "PinCheck",
    "PinDesign",
    "PinMaterial",
    "PinProblem",
    "PinSteel",
    "Profile",
    "Scene",
    "Stepped",
    "check",
    "design",
    "explain",
    "force_limit",
    "free_bores",
    "judge",
    "load_sweep",
]
