"""A rod reduced to its two pins: the common result of all measurement methods."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.errors import require
from solvers.numerics.uncertainty import Function, Propagated, propagate


@dataclass(frozen=True)
class RodMasses:
    """Reduced masses, SI units, None if the method does not determine them; ``uncertainty`` has the same keys."""

    values: Mapping[str, float | None]
    uncertainty: Propagated | None
    warnings: tuple[str, ...] = ()


def require_known(owner: object, uncertainty: Mapping[str, float]) -> None:
    """Raise InvalidInput for an uncertainty that is negative or belongs to no quantity of ``owner``."""
    for name, u in uncertainty.items():
        known = isinstance(getattr(owner, name, None), (int, float))
        require(known, f"uncertainty.{name}", "belongs to no quantity that was given", "names of the quantities")
        require(math.isfinite(u) and u >= 0, f"uncertainty.{name}", "must not be negative", "[0, inf)")


def reduced_masses(cg: NDArray, length: NDArray, mass: NDArray, inertia: NDArray) -> dict[str, NDArray]:
    """Two-mass model of a rod: m_A = m (L - l_A)/L, m_B = m l_A/L, Delta J = m l_A (L - l_A) - J_0. SI units."""
    return {
        "rod_cg_from_pin": cg,
        "rod_mass_at_pin": mass * (length - cg) / length,
        "rod_mass_at_crank": mass * cg / length,
        "rod_inertia": inertia,
        "inertia_defect": mass * cg * (length - cg) - inertia,
        "rod_mass": mass,
    }


def inputs_of(owner: Any) -> dict[str, float]:
    """The quantities of a measurement that were given, by name."""
    values = {field.name: getattr(owner, field.name) for field in fields(owner) if field.name != "uncertainty"}
    return {name: float(value) for name, value in values.items() if value is not None}


def evaluate(formula: Function, owner: Any, warnings: Sequence[str]) -> RodMasses:
    """Evaluate a formula of a measurement's inputs, and propagate their uncertainties if any is positive."""
    values = inputs_of(owner)
    found = formula({name: np.array(value) for name, value in values.items()})
    given = {name: float(u) for name, u in owner.uncertainty.items() if u > 0}
    return RodMasses(
        {name: float(np.asarray(value)) for name, value in found.items()},
        propagate(formula, values, given) if given else None,
        tuple(warnings),
    )
