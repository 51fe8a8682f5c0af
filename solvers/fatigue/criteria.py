"""Fatigue safety in the Haigh diagram: each criterion is a limiting curve, evaluated by a common method.

A stress cycle (amplitude sigma_a, mean sigma_m) is scaled along its ray until it meets the limiting curve; the factor
is the safety n, its inverse the utilisation. K multiplies the amplitude; none of these criteria credits a compressive
mean stress here.

  Serensen-Kinasoshvili  1/n = (K sigma_a + psi max(sigma_m, 0)) / sigma_-1
  Goodman                1/n = K sigma_a/sigma_-1 + max(sigma_m, 0)/sigma_u
  Soderberg              1/n = K sigma_a/sigma_-1 + max(sigma_m, 0)/sigma_y
  FKM                    slope M up to R = 0, M/3 up to R = 1/2, constant beyond, with M = psi
  Gerber                 n K sigma_a/sigma_-1 + (n sigma_m/sigma_u)^2 = 1

Sources: S. V. Serensen, R. M. Shneiderovich, V. P. Kogaev (machine-part strength); J. E. Shigley; FKM guideline,
Analytical strength assessment (mean stress factor by fields of the stress ratio).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np

from solvers.errors import InvalidInput
from solvers.fatigue.kernels import Diagram
from solvers.materials import Material


class FatigueCriterion(Protocol):
    """A limiting curve in the Haigh diagram: a name and its kernel representation."""

    @property
    def name(self) -> str:
        """Name in results."""

    def diagram(self) -> Diagram:
        """The curve for kernels; positively homogeneous of degree one."""


@dataclass(frozen=True)
class HaighLines:
    """A piecewise linear limiting curve: 1/n = max over corners of min over the lines alpha sigma_a + beta sigma_m.

    The lines of one corner are alternatives, of which the least restrictive governs (a non-convex kink); all corners
    apply. Each line is (alpha, beta) in 1/Pa.
    """

    name: str
    corners: tuple[tuple[tuple[float, float], ...], ...]

    def diagram(self) -> Diagram:
        """The lines; corners with fewer lines repeat their last one. Computed once: not to be written to."""
        return self._diagram

    @cached_property
    def _diagram(self) -> Diagram:
        longest = max(len(lines) for lines in self.corners)
        padded = np.array([lines + (lines[-1],) * (longest - len(lines)) for lines in self.corners], dtype=float)
        return Diagram(np.concatenate([padded, np.zeros((*padded.shape[:2], 1))], axis=2), np.zeros(3))


@dataclass(frozen=True)
class Gerber:
    """Gerber's parabola, met by the ray at 1/n = (a + sqrt(a^2 + 4 m^2))/2.

    a = alpha sigma_a with alpha = K/sigma_-1, m = beta max(sigma_m, 0) with beta = 1/sigma_u, both in 1/Pa.
    """

    alpha: float
    beta: float
    name: str = "gerber"

    def diagram(self) -> Diagram:
        """The parabola alone."""
        return Diagram(np.zeros((0, 1, 3)), np.array([self.alpha, self.beta, 0.0]))


def _straight(name: str, material: Material, mean_slope: float) -> HaighLines:
    alpha = material.fatigue_reduction / material.fatigue_limit
    return HaighLines(name, (((alpha, 0.0),), ((alpha, mean_slope),)))


@lru_cache(maxsize=64)
def serensen(material: Material) -> HaighLines:
    """The Serensen-Kinasoshvili criterion, used in the paper."""
    return _straight("serensen", material, material.mean_stress_sensitivity / material.fatigue_limit)


def soderberg(material: Material) -> HaighLines:
    """Soderberg: the mean stress is limited by the yield strength."""
    return _straight("soderberg", material, 1.0 / material.yield_strength)


def goodman(material: Material) -> HaighLines:
    """Modified Goodman: the mean stress is limited by the ultimate strength."""
    return _straight("goodman", material, 1.0 / _ultimate(material))


def gerber(material: Material) -> Gerber:
    """Gerber's parabola through the ultimate strength."""
    return Gerber(material.fatigue_reduction / material.fatigue_limit, 1.0 / _ultimate(material))


def fkm(material: Material) -> HaighLines:
    """FKM's mean stress factor: slope M, then M/3 from R = 0, constant from R = 1/2.

    Field II  sigma_a + M sigma_m = sigma_-1;  field III  sigma_a + (M/3) sigma_m = sigma_-1 (1 + M/3)/(1 + M); field IV
    sigma_a = sigma_-1 (1 + M/3)/(1 + M)^2, reached at R = 1/2, where sigma_m = 3 sigma_a.
    """
    M = material.mean_stress_sensitivity
    alpha = material.fatigue_reduction / material.fatigue_limit
    third = (1.0 + M) / (1.0 + M / 3.0)
    return HaighLines(
        "fkm",
        (
            ((alpha, 0.0),),
            (
                (alpha, M / material.fatigue_limit),
                (alpha * third, third * M / 3.0 / material.fatigue_limit),
                (alpha * third * (1.0 + M), 0.0),
            ),
        ),
    )


CRITERIA = {"serensen": serensen, "goodman": goodman, "gerber": gerber, "soderberg": soderberg, "fkm": fkm}
"""The criteria by name, as functions of the material."""


def _ultimate(material: Material) -> float:
    if material.ultimate_strength is None:
        raise InvalidInput(
            "material.ultimate_strength",
            "is needed by this fatigue criterion",
            "a strength not below the yield strength",
        )
    return material.ultimate_strength
