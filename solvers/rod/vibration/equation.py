"""The strip's equation of motion in its modes under the mean axial force.

With g the static shape per unit stroke s under the mean force, V = s g + sum_n a_n psi_n in the modes, which have unit
stiffness and masses mu_n, so that with G the geometric stiffness and swing = P - mean

    M a'' + C (a - c)' + (1 + swing G) a = f = (1 + swing G) c + s b,   b_n = int rho A omega^2 psi_n g dz

where c holds the quasi-static shape, and C = eta M^(1/2) is modal damping by the loss factor eta = 2 zeta: a mode by
itself reaches 1/eta times its static amplitude at resonance. It acts on d = a - c, what inertia adds; so a slow strip
is the quasi-static one whatever eta is. Without shear c follows from its weak form,
(1 + swing G) c = -s swing h with h_n = int g' psi_n' dz + e g'(l) psi_n'(l), diagonal in coordinates of G's own. With
shear (``solvers.rod.strip.shear``) V = W/m - gamma D z, W = int psi dz, where W obeys the same equation under
P_s = EI q_s, with the stroke W(l) + e W'(l) and the moment EI (W'' + e W''') at the pin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.errors import InvalidInput
from solvers.numerics.jit import kernel
from solvers.rod.cycle.state import CLAMP, COUPLING, FORCE, HEAD, SHEAR, SOFTENING, STROKE, Strip, constants
from solvers.rod.strip.shape import bend
from solvers.rod.vibration.natural_frequencies import StripBasis, strip_basis

Array = NDArray[np.float64]

_SOFTEST = 0.1
"""Of a mode's stiffness: no frequency is taken for lower than under that."""


@dataclass(frozen=True)
class StripEquation:
    """``slowness`` holds mu_n [rad^2], the greatest first, ``loss`` eta; ``modes`` takes amplitudes of the modes to
    those of the basis; ``coupling`` is G [1/N], ``stretched`` h, ``carried`` b [1/m] and ``clamp`` V'' and V''' of the
    modes at the clamp, (2, modes); ``tip`` EI psi_n'(l) and ``leaning`` int rho A omega^2 psi_n z dz, of which shear
    makes use."""

    strip: Strip
    loss: float
    basis: StripBasis
    mean: float
    slowness: Array
    modes: Array
    coupling: Array
    stretched: Array
    carried: Array
    clamp: Array
    tip: Array
    leaning: Array

    @staticmethod
    def of(strip: Strip, inertia: float, mean: float, polynomials: int, loss: float) -> StripEquation:
        """For rho A omega^2 = ``inertia`` [N/m^2] and the mean force [N]. Raises InvalidInput where that buckles it."""
        l, e = strip.length, strip.rod_length - strip.length
        basis, mean = strip_basis(l, strip.rod_length, polynomials), mean * strip.couples
        try:
            lower = np.linalg.cholesky(strip.stiffness * basis.bending + mean * basis.geometric)
        except np.linalg.LinAlgError:
            raise InvalidInput(
                "dimensions.h", "the strip buckles under the mean force of the cycle", "thicker"
            ) from None
        # The greatest masses are known best, and they come first.
        half = np.linalg.solve(lower, inertia * basis.mass)
        whole = np.linalg.solve(lower, half.T)
        slowness, modes = np.linalg.eigh(0.5 * (whole + whole.T))
        modes = np.linalg.solve(lower.T, modes)[:, ::-1]
        stations, weights = basis.quadrature()
        slope, value = _static_shape(mean / strip.stiffness, l, strip.rod_length, np.append(stations, l))
        turned = basis.values(np.append(stations, l), 1) @ modes
        borne = inertia * weights[:, None] * (basis.values(stations, 0) @ modes)
        return StripEquation(
            strip=strip,
            loss=loss,
            basis=basis,
            mean=mean,
            slowness=np.ascontiguousarray(slowness[::-1]),
            modes=modes,
            coupling=np.ascontiguousarray(modes.T @ basis.geometric @ modes) * strip.couples,
            stretched=(np.append(weights, e) * slope) @ turned * strip.couples,
            carried=value[:-1] @ borne,
            clamp=np.concatenate([basis.values(np.zeros(1), order) for order in (2, 3)]) @ modes,
            tip=strip.stiffness * turned[-1],
            leaning=stations @ borne,
        )

    @property
    def pace(self) -> Array:
        """The modes' natural frequencies under the mean force [1/rad], the slowest first."""
        return 1.0 / np.sqrt(self.slowness)

    @property
    def damping(self) -> Array:
        """C of every mode [rad]."""
        return self.loss * np.sqrt(self.slowness)

    def fastest(self, modes: int, swing: Array) -> Array:
        """Natural frequency [1/rad] of the last of so many modes by itself, under forces beside the mean."""
        last = modes - 1
        return self.pace[last] * np.sqrt(np.maximum(1.0 + swing * self.coupling[last, last], _SOFTEST))

    def swing(self, states: Array) -> Array:
        """P - mean [N] as far as it bends the strip, from a table of states."""
        return self.strip.couples * states[FORCE] - self.mean

    def still(self, states: Array) -> Array:
        """c, the quasi-static amplitudes: (angles, modes)."""
        swing, stroke = self.swing(states), states[STROKE]
        if self.strip.compliance == 0.0:
            return self._static(swing, -(stroke * swing)[:, None] * self.stretched)
        l, e, softening = self.strip.length, self.strip.rod_length - self.strip.length, states[SOFTENING]
        bent, turned, sunk = np.empty((3, swing.size))
        bend(*(states[row] for row in (COUPLING, CLAMP, SHEAR, HEAD)), l, l, bent, turned, sunk)
        swing = self.strip.stiffness * states[COUPLING] - self.mean
        stroke_of_w = sunk + e * turned
        moment = bent + e * (states[COUPLING] * turned + states[SHEAR])
        w = self._static(swing, np.outer(moment, self.tip) - np.outer(stroke_of_w * swing, self.stretched))
        beside = np.outer(stroke_of_w / softening - stroke, self.carried)
        beside -= np.outer(self.strip.compliance * states[SHEAR], self.leaning)
        return w / softening[:, None] + beside / self.slowness

    def right(self, states: Array, still: Array) -> Array:
        """f, from the states and c at the same angles: (angles, modes)."""
        held = still + self.swing(states)[:, None] * (still @ self.coupling)
        return held + np.outer(states[STROKE], self.carried)

    def _static(self, swing: Array, load: Array) -> Array:
        """(1 + swing G)^-1 load."""
        rates, turned = np.linalg.eigh(self.coupling)
        return ((load @ turned) / (1.0 + np.outer(swing, rates))) @ turned.T


@kernel
def _static_shape(q: float, l: float, rod_length: float, stations: Array) -> tuple[Array, Array]:
    """g' and g at the stations for the coupling q, without shear."""
    _, _, clamp, shear, head = constants(q, l, rod_length, 0.0)
    one = np.array([[q], [clamp], [shear], [head]])
    slope, value, unused = np.empty(stations.size), np.empty(stations.size), np.empty(1)
    for i in range(stations.size):
        bend(one[0], one[1], one[2], one[3], l, stations[i], unused, slope[i : i + 1], value[i : i + 1])
    return slope, value
