"""The slider-crank mechanism: its kinematics, its forces over the cycle, and the reduction of its masses.

from solvers import crank

scene = crank.Scene(crank.Mechanism(...), crank.Cylinder(...), crank.TablePressure(...), crank.Masses(...))
outcome = crank.analyse(scene)
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "CrankDynamics": "analysis",
    "analyse": "analysis",
    "EFFECTS": "effects",
    "IndicatorPressure": "indicator",
    "STROKES": "indicator",
    "Stroke": "indicator",
    "Estimate": "mass_reduction",
    "Pendulum": "mass_reduction",
    "RodMasses": "mass_reduction",
    "USUAL": "mass_reduction",
    "Weighing": "mass_reduction",
    "estimate": "mass_reduction",
    "swing": "mass_reduction",
    "weigh": "mass_reduction",
    "CrankThrow": "masses",
    "RodMass": "masses",
    "three_particles": "masses",
    "ExactMotion": "motion",
    "TwoHarmonicMotion": "motion",
    "TablePressure": "pressure",
    "Repair": "repair",
    "repaired_indicator": "repair",
    "repaired_table": "repair",
    "Cylinder": "scene",
    "Engine": "scene",
    "Masses": "scene",
    "Mechanism": "scene",
    "Scene": "scene",
}
"""Every name of this wing, and the room it lives in; a room is entered when a name of it is asked for."""

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
