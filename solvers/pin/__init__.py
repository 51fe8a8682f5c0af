"""The piston pin: the lightest bore for a given outer diameter.

from solvers import pin

scene = pin.Scene(pin.Geometry(...), force, pin.PinMaterial(...))
outcome = pin.design(pin.PinProblem(scene))
"""

from solvers.effects import ALL, AUTO, EffectSelection
from solvers.pin.bulk.many import Case, check_many
from solvers.pin.bulk.table import PinTable, check_bores
from solvers.pin.capacity import force_limit
from solvers.pin.check import PinCheck, Stress, check
from solvers.pin.cones import Cone
from solvers.pin.design import PinDesign, PinProblem, design, explain
from solvers.pin.diagnosis import Diagnosis
from solvers.pin.effects import EFFECTS
from solvers.pin.family import LoadProfile, free_bores, load_sweep
from solvers.pin.loads import LoadCase, MacaulayTerm
from solvers.pin.pointwise import Constant, Free
from solvers.pin.profile import Profile
from solvers.pin.scene import Geometry, Limits, PinMaterial, Scene
from solvers.pin.section import CRITERIA
from solvers.pin.stepped import Stepped
from solvers.pin.verdict import judge

__all__ = [
    "ALL",
    "AUTO",
    "CRITERIA",
    "EFFECTS",
    "Case",
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
    "free_bores",
    "judge",
    "load_sweep",
]
