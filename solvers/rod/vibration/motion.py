"""The strip's periodic motion at a given resolution, and its errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.numerics.periodic import TURN
from solvers.numerics.radau import Radau, interpolation_weights
from solvers.numerics.ripple import Ripple, no_ripple, parts_at
from solvers.rod.cycle.state import Strip
from solvers.rod.vibration.excitation import RULE
from solvers.rod.vibration.natural_frequencies import StripBasis


@dataclass(frozen=True)
class Errors:
    """Estimated errors of a motion, as fractions of the greatest V'' or V''' at the clamp, whichever is affected more.

    series        truncation of the series of the fast modes
    space         truncation of the polynomials along the strip
    omitted       modes whose ringing is omitted: in greatest values and, ``mean_omitted``, in means over the revolution
    phase         phase errors of the ringing modes
    excited       ringing excited by the smooth force between corners
    time          discretization in time, of every element (elements,), and, ``mean_time``, its mean over the revolution
    rounding      rounding errors, amplified by the periodicity condition
    """

    series: float
    space: float
    omitted: float
    mean_omitted: float
    phase: float
    excited: float
    time: Array
    mean_time: float
    rounding: float

    @property
    def elements(self) -> float:
        """Discretization error of all elements: independent errors, added in squares."""
        return float(np.sqrt(np.sum(self.time**2)))

    @property
    def total(self) -> float:
        return self.series + self.space + self.rounding + self.omitted + self._oscillating

    @property
    def _oscillating(self) -> float:
        """Errors that oscillate at the frequency of the slowest mode or faster."""
        return self.phase + self.excited + self.elements

    def of_mean(self, remainder: float) -> float:
        """Error of a mean over the revolution, in which the fraction ``remainder`` of oscillating errors remains."""
        steady = self.series + self.space + self.rounding + self.mean_time + self.mean_omitted
        return steady + remainder * self._oscillating


@dataclass(frozen=True)
class Motion:
    """The dynamic part d of the motion, i.e. its difference from the quasi-static shape.

    samples            amplitudes of the basis (elements, points, basis), on ``edges`` at the points of ``rule``
    ringing            free vibration of fast modes, in closed form
    amplification      of an error made in one revolution by the periodicity condition, 1/sigma_min(I - M)
    slow               number of slow modes
    highest_frequency  of the last slow mode [1/rad]
    phase_tolerances   admissible phase errors of the ringing modes per element [rad], (ringing,)
    """

    strip: Strip
    basis: StripBasis
    edges: Array
    samples: Array
    ringing: Ripple
    errors: Errors
    amplification: float
    slow: int
    highest_frequency: float
    phase_tolerances: Array
    rule: Radau = RULE

    @property
    def without_ringing(self) -> Motion:
        """This motion without its ringing: discontinuous at corners."""
        return replace(self, ringing=no_ripple(self.samples.shape[2], self.rule))

    def at(self, angle: Array) -> Array:
        """d in amplitudes of the basis at the angles: (basis, angles)."""
        return amplitudes(self.edges, self.samples, self.rule, self.ringing, angle)


@kernel
def amplitudes(edges: Array, samples: Array, rule: Radau, ringing: Ripple, angle: Array) -> Array:
    """Amplitudes (basis, angles) of polynomials (elements, points, basis) on elements over the revolution, plus
    ringing, at the angles."""
    p, basis = samples.shape[1], samples.shape[2]
    out, share, row = parts_at(ringing, angle), np.empty(p), np.empty(basis)
    for i in range(angle.size):
        turns = (angle[i] - edges[0]) / TURN
        place = edges[0] + (turns - np.floor(turns)) * TURN
        e = min(max(np.searchsorted(edges, place, side="right"), 1), edges.size - 1) - 1
        interpolation_weights(rule.points, rule.weights, (place - edges[e]) / (edges[e + 1] - edges[e]), share)
        row[:] = 0.0
        for k in range(p):
            for b in range(basis):
                row[b] += share[k] * samples[e, k, b]
        for b in range(basis):
            out[b, i] += row[b]
    return out
