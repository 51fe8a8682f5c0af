"""Standard uncertainties: linear propagation, and Monte Carlo where it is not valid.

Source: JCGM 100 (GUM) for linear propagation, JCGM 101 for Monte Carlo. Inputs are independent and normally
distributed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Function = Callable[[dict[str, NDArray]], dict[str, NDArray]]
"""Named input arrays -> named output arrays of the same shape; built from operations that support complex numbers."""

_COMPLEX_STEP = 1e-100
_DRAWS = 100_000
_SEED = 20260101
_ROUNDING = 1e-12
_LINEAR_TOLERANCE = 0.1
"""Relative difference up to which linear propagation is preferred to Monte Carlo."""


@dataclass(frozen=True)
class Propagated:
    """Standard uncertainty of each output, the method, and for Monte Carlo the central 95 % interval."""

    standard: Mapping[str, float]
    method: str
    interval: Mapping[str, tuple[float, float]]


def sensitivities(function: Function, values: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """d output/d input by the complex step, exact to rounding: {output: {input: derivative}}."""
    names = list(values)
    matrix = np.eye(len(names)) * 1j * _COMPLEX_STEP
    inputs = {name: values[name] + matrix[i] for i, name in enumerate(names)}
    each = np.zeros(len(names))  # an output may depend on no input
    return {
        out: dict(zip(names, (each + found.imag / _COMPLEX_STEP).tolist(), strict=True))
        for out, found in function(inputs).items()
    }


def combined(by_input: Mapping[str, float], standard: Mapping[str, float]) -> float:
    """u_y of u_y^2 = sum (dy/dx_i)^2 u_i^2, from the derivatives by input and the inputs' standard uncertainties."""
    return float(np.hypot.reduce([d * standard.get(name, 0.0) for name, d in by_input.items()]))


def _monte_carlo(function: Function, values: Mapping[str, float], standard: Mapping[str, float]) -> dict[str, NDArray]:
    """Outputs for random inputs; a fixed seed makes results reproducible."""
    normal = _normal(len(values))
    known = {name: standard.get(name, 0.0) for name in values}
    inputs = {n: v + known[n] * normal[i] if known[n] else np.float64(v) for i, (n, v) in enumerate(values.items())}
    with np.errstate(all="ignore"):
        return function(inputs)


@lru_cache(maxsize=4)
def _normal(inputs: int) -> NDArray:
    return np.random.default_rng(_SEED).standard_normal((inputs, _DRAWS))


def propagate(function: Function, values: Mapping[str, float], standard: Mapping[str, float]) -> Propagated:
    """Linear propagation if Monte Carlo agrees within a tenth, otherwise Monte Carlo."""
    derivatives = sensitivities(function, values)
    linear_uncertainty = {out: combined(by_input, standard) for out, by_input in derivatives.items()}
    samples = _monte_carlo(function, values, standard)
    deviation = {name: float(np.std(found)) for name, found in samples.items()}
    magnitude = {
        name: float(np.abs(found)) for name, found in function({n: np.array(v) for n, v in values.items()}).items()
    }
    if all(
        abs(deviation[n] - u) <= max(_LINEAR_TOLERANCE * u, _ROUNDING * magnitude[n])
        for n, u in linear_uncertainty.items()
    ):
        return Propagated(linear_uncertainty, "linear", {})
    interval = {name: tuple(np.quantile(found, [0.025, 0.975]).tolist()) for name, found in samples.items()}
    return Propagated(deviation, "Monte Carlo", interval)
