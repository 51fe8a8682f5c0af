"""The slider-crank mechanism: kinematics, forces over the cycle, and reduction of its masses.

scene = crank.Scene(crank.Mechanism(...), crank.Cylinder(...), crank.TablePressure(...), crank.Masses(...))
outcome = crank.analyse(scene)
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_PUBLIC = {
    "bulk": ("Case", "analyse_many"),
    "check": ("CrankDynamics", "analyse"),
    "effects": ("EFFECTS",),
    "gas.data_faults": ("Repair",),
    "gas.indicator_diagram": ("STROKES", "IndicatorPressure", "Stroke", "repaired_indicator"),
    "gas.pressure_table": ("TablePressure", "repaired_table"),
    "masses.measurement": ("USUAL", "Estimate", "Pendulum", "RodMasses", "Weighing", "estimate", "swing", "weigh"),
    "masses.two_mass_model": ("CrankThrow", "RodMass"),
    "motion.slider_crank": ("ExactMotion",),
    "scene": ("Cylinder", "Engine", "Masses", "Mechanism", "Scene"),
}
"""Public names by the submodules that define them, imported lazily on first access."""

_SUBMODULE_OF = {name: submodule for submodule, names in _PUBLIC.items() for name in names}

__all__ = sorted(_SUBMODULE_OF)


def __getattr__(name: str) -> Any:
    if name not in _SUBMODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(f"{__name__}.{_SUBMODULE_OF[name]}"), name)
    return found
