"""The slider-crank mechanism: kinematics, forces over the cycle, and reduction of its masses.

scene = crank.Scene(crank.Mechanism(...), crank.Cylinder(...), crank.TablePressure(...), crank.Masses(...))
outcome = crank.analyse(scene)
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_SUBMODULE_OF = {
    "Case": "bulk",
    "analyse_many": "bulk",
    "CrankDynamics": "check",
    "analyse": "check",
    "EFFECTS": "effects",
    "IndicatorPressure": "gas.indicator_diagram",
    "STROKES": "gas.indicator_diagram",
    "Stroke": "gas.indicator_diagram",
    "Estimate": "masses.measurement",
    "Pendulum": "masses.measurement",
    "RodMasses": "masses.measurement",
    "USUAL": "masses.measurement",
    "Weighing": "masses.measurement",
    "estimate": "masses.measurement",
    "swing": "masses.measurement",
    "weigh": "masses.measurement",
    "CrankThrow": "masses.two_mass_model",
    "RodMass": "masses.two_mass_model",
    "ExactMotion": "motion.slider_crank",
    "TablePressure": "gas.pressure_table",
    "Repair": "gas.data_faults",
    "repaired_indicator": "gas.indicator_diagram",
    "repaired_table": "gas.pressure_table",
    "Cylinder": "scene",
    "Engine": "scene",
    "Masses": "scene",
    "Mechanism": "scene",
    "Scene": "scene",
}
"""Public names and the submodules that define them, imported lazily on first access."""

__all__ = sorted(_SUBMODULE_OF)


def __getattr__(name: str) -> Any:
    if name not in _SUBMODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(f"{__name__}.{_SUBMODULE_OF[name]}"), name)
    return found
