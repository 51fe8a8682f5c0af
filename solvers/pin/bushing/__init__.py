"""The other bar of the paper: the bore is given, the outer diameter is sought (bushing, sleeve, shaft)."""

from solvers.pin.bushing.check import BushingCheck, check
from solvers.pin.bushing.design import BushingDesign, BushingProblem, design
from solvers.pin.bushing.forms import Constant, Stepped, Turned
from solvers.pin.bushing.scene import BushingGeometry, BushingScene
from solvers.pin.bushing.verdict import judge

__all__ = [
    "BushingCheck",
    "BushingDesign",
    "BushingGeometry",
    "BushingProblem",
    "BushingScene",
    "Constant",
    "Stepped",
    "Turned",
    "check",
    "design",
    "judge",
]
