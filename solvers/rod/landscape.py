"""The design space of the strip in the variables in which it is simple.

With tau = 1/(b h^3) the coupling is q = 12 P tau/E and EI = E/(12 tau): stability, side force, clamp moment, and with
them contact and friction, depend on (tau, l) alone. For given (tau, l) the stresses are h^2 A(phi) +- h B(z, phi),
which grow with h, and the mass is rho l/(tau h^2). So what three dimensions have to satisfy becomes, at every (tau, l),
one interval of thickness, and a design is a search over two variables.

The landscape knows gas load, reciprocating inertia, beam-column and friction; what else a scene calls for is met by
``design`` on the full model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.crank import kinematics
from solvers.fatigue import FatigueCriterion
from solvers.numerics.periodic import grid
from solvers.rod import beam_column, envelope, guide
from solvers.rod.cycle import Array, Composition, Cycle
from solvers.rod.problem import RodProblem
from solvers.rod.scene import Dimensions
from solvers.rod.stability import critical_parameter

ANGLES = 96
STATIONS = 25
_THICKNESS_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Landscape:
    """A problem, its fatigue convention and its force terms, made ready for many evaluations.

    ``limits`` are the requirements as the landscape must meet them: the problem's own, shifted by what effects beyond
    the landscape change.
    """

    problem: RodProblem
    criterion: FatigueCriterion
    composition: Composition
    fatigue_limit: float
    stability_limit: float
    yield_limit: float | None
    pressure_limit: float | None
    power_limit: float | None

    @cached_property
    def angle(self) -> Array:
        return grid(ANGLES)

    @cached_property
    def force(self) -> Array:
        lower = Dimensions(self.problem.bounds.b[0], self.problem.bounds.h[0], self.problem.bounds.l[0])
        return Cycle(self.problem.scene, lower, self.composition).axial_force(self.angle)

    @cached_property
    def stroke(self) -> Array:
        return self.problem.scene.mechanism.crank_radius * np.sin(self.angle)

    @cached_property
    def compression(self) -> float:
        return max(float(-self.force.min()), 0.0)

    @cached_property
    def speed(self) -> Array:
        m = self.problem.scene.mechanism
        return np.abs(kinematics.velocity(self.angle, m.crank_radius, m.rod_length, m.angular_speed))

    def stability(self, tau: float, length: float) -> float:
        """n_st in the crank's plane; inf for a rod that is never compressed."""
        scene = self.problem.scene
        if self.compression == 0:
            return math.inf
        u = float(critical_parameter(length / scene.mechanism.rod_length))
        return scene.material.elastic_modulus * u * u / (12.0 * tau * scene.mechanism.rod_length**2 * self.compression)

    def greatest_tau(self, length: float) -> float:
        """The tau at which the required stability is just met."""
        return self.stability(1.0, length) / self.stability_limit

    def reactions(self, tau: float, length: float) -> tuple[float, float, float]:
        """Greatest side force [N] and contact pressure [Pa], and friction power [W]."""
        scene, piston = self.problem.scene, self.problem.scene.piston
        stiffness = scene.material.elastic_modulus / (12.0 * tau)
        constants = beam_column.solve(self.force / stiffness, length, scene.mechanism.rod_length)
        side = -stiffness * constants.clamp_shear * self.stroke
        moment = stiffness * constants.clamp_curvature * self.stroke
        pressure = guide.contact_pressure(side, moment, piston.clamp_offset, piston.diameter, piston.skirt_length)
        friction = guide.friction_force(
            side, moment, piston.clamp_offset, piston.skirt_length, piston.friction_coefficient
        )
        return float(np.abs(side).max()), float(pressure.max()), float(np.mean(friction * self.speed))

    def stresses(self, tau: float, length: float, h: float) -> tuple[float, float]:
        """Fatigue utilisation and greatest stress [Pa] of the strip; inf beyond buckling."""
        scene = self.problem.scene
        high, low = np.empty((2, STATIONS)), np.empty((2, STATIONS))
        stands = envelope.stress_envelope(
            self.force,
            self.stroke,
            scene.material.elastic_modulus,
            1.0 / (tau * h**3),
            h,
            length,
            scene.mechanism.rod_length,
            high,
            low,
        )
        if not stands:
            return math.inf, math.inf
        utilisation = self.criterion.utilisation(0.5 * (high - low), 0.5 * (high + low))
        return float(np.max(utilisation)), float(max(high.max(), -low.min()))

    def excess(self, tau: float, length: float, h: float) -> float:
        """By how much the worse of fatigue and yield exceeds its limit, relative; negative where both are met."""
        utilisation, stress = self.stresses(tau, length, h)
        worst = utilisation * self.fatigue_limit
        if self.yield_limit is not None:
            worst = max(worst, stress * self.yield_limit / self.problem.scene.material.yield_strength)
        return worst - 1.0

    def thickness_range(self, tau: float) -> tuple[float, float]:
        """The thicknesses [m] that the bounds of h and b leave at this tau; empty when the first exceeds the second."""
        bounds = self.problem.bounds
        low = max(bounds.h[0], (tau * bounds.b[1]) ** (-1.0 / 3.0))
        high = min(bounds.h[1], (tau * bounds.b[0]) ** (-1.0 / 3.0))
        # A range of one thickness must not vanish by rounding.
        return (low, max(high, low)) if high > low * (1 - 1e-12) else (low, high)

    def admissible(self, tau: float, length: float) -> tuple[float, float] | None:
        """The thicknesses [m] with which (tau, l) meets every requirement, or None."""
        if self.stability(tau, length) < self.stability_limit * (1 - 1e-12):
            return None
        low, high = self.thickness_range(tau)
        if high < low:
            return None
        if self.pressure_limit is not None or self.power_limit is not None:
            _, pressure, power = self.reactions(tau, length)
            if self.pressure_limit is not None and pressure > self.pressure_limit:
                return None
            if self.power_limit is not None and power > self.power_limit:
                return None
        if self.excess(tau, length, low) > 0:
            return None
        if self.excess(tau, length, high) <= 0:
            return low, high
        from scipy.optimize import brentq

        root = brentq(lambda h: self.excess(tau, length, h), low, high, xtol=1e-15, rtol=_THICKNESS_TOLERANCE)
        return low, max(low, root * (1 - 2 * _THICKNESS_TOLERANCE))

    def dimensions(self, tau: float, length: float, h: float) -> Dimensions:
        """The strip of a point of the landscape, its width within its bounds to the last place."""
        low, high = self.problem.bounds.b
        return Dimensions(min(max(1.0 / (tau * h**3), low), high), h, length)
