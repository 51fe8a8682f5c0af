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

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
    """The equation of one strip, or of several, all of whose arrays then have a leading axis of strips.

    ``slowness`` holds mu_n [rad^2], the greatest first, ``loss`` eta; ``modes`` takes amplitudes of the modes to those
    of the basis; ``coupling`` is G [1/N], ``stretched`` h, ``carried`` b [1/m] and ``clamp`` V'' and V''' of the modes
    at the clamp, (2, modes); ``tip`` EI psi_n'(l) and ``leaning`` int rho A omega^2 psi_n z dz, of which shear makes
    use. Those of several strips have one ``loss``, and all or none of them are flexible in shear.
    """

    strip: Strip
    loss: float
    basis: StripBasis
    mean: Array
    slowness: Array
    modes: Array
    coupling: Array
    stretched: Array
    carried: Array
    clamp: Array
    tip: Array
    leaning: Array

    @staticmethod
    def of(strip: Strip, inertia: ArrayLike, mean: ArrayLike, polynomials: int, loss: float) -> StripEquation:
        """For rho A omega^2 = ``inertia`` [N/m^2] and the mean force [N], one for each strip. Raises InvalidInput where
        that buckles it."""
        l = np.asarray(strip.length)[..., None, None]
        basis, mean = strip_basis(strip.length, strip.rod_length, polynomials), np.asarray(mean) * strip.couples
        stiffness, inertia = np.asarray(strip.stiffness)[..., None, None], np.asarray(inertia)[..., None, None]
        try:
            lower = np.linalg.cholesky(stiffness * basis.bending + mean[..., None, None] * basis.geometric)
        except np.linalg.LinAlgError:
            raise InvalidInput(
                "dimensions.h", "the strip buckles under the mean force of the cycle", "thicker"
            ) from None
        # The greatest masses are known best, and they come first.
        half = np.linalg.solve(lower, inertia * basis.mass)
        whole = np.linalg.solve(lower, half.mT)
        slowness, modes = np.linalg.eigh(0.5 * (whole + whole.mT))
        modes = np.linalg.solve(lower.mT, modes)[..., ::-1]
        zeta, weights = basis.quadrature()
        ends = np.append(zeta, 1.0)
        coupling, stations = mean / strip.stiffness, l[..., 0] * ends
        slope, value = each(mean.shape, _static_shape, coupling, strip.length, strip.rod_length, stations)
        turned = basis.values(ends, 1) @ modes
        borne = inertia * l * weights[:, None] * (basis.values(zeta, 0) @ modes)
        couples, head = np.asarray(strip.couples)[..., None], np.asarray(strip.rod_length)[..., None] - l[..., 0]
        weighed = np.concatenate([l[..., 0] * weights, head], axis=-1) * slope
        return StripEquation(
            strip=strip,
            loss=loss,
            basis=basis,
            mean=mean,
            slowness=np.ascontiguousarray(slowness[..., ::-1]),
            modes=modes,
            coupling=np.ascontiguousarray(modes.mT @ basis.geometric @ modes) * couples[..., None],
            stretched=(weighed[..., None, :] @ turned)[..., 0, :] * couples,
            carried=(value[..., None, :-1] @ borne)[..., 0, :],
            clamp=np.concatenate([basis.values(np.zeros(1), order) for order in (2, 3)], axis=-2) @ modes,
            tip=stiffness[..., 0] * turned[..., -1, :],
            leaning=((l[..., 0] * zeta)[..., None, :] @ borne)[..., 0, :],
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
        """Natural frequency [1/rad] of the last of so many modes of one strip by itself, under forces beside the
        mean."""
        last = modes - 1
        return self.pace[last] * np.sqrt(np.maximum(1.0 + swing * self.coupling[last, last], _SOFTEST))

    def swing(self, states: Array) -> Array:
        """P - mean [N] as far as it bends the strip, (..., angles), from a table of states (rows, ..., angles)."""
        return np.asarray(self.strip.couples)[..., None] * states[FORCE] - self.mean[..., None]

    def still(self, states: Array) -> Array:
        """c, the quasi-static amplitudes: (..., angles, modes)."""
        swing, stroke = self.swing(states), states[STROKE]
        if not np.any(self.strip.compliance):
            return self._static(swing, -(stroke * swing)[..., None] * self.stretched[..., None, :])
        l, rod_length, stiffness, compliance = (
            np.asarray(part)[..., None]
            for part in (self.strip.length, self.strip.rod_length, self.strip.stiffness, self.strip.compliance)
        )
        coupling, softening = states[COUPLING], states[SOFTENING]
        ends = (states[row] for row in (COUPLING, CLAMP, SHEAR, HEAD))
        bent, turned, sunk = each(self.mean.shape, _at_the_end, *ends, l[..., 0])
        swing = stiffness * coupling - self.mean[..., None]
        stroke_of_w = sunk + (rod_length - l) * turned
        moment = bent + (rod_length - l) * (coupling * turned + states[SHEAR])
        load = moment[..., None] * self.tip[..., None, :]
        load = load - (stroke_of_w * swing)[..., None] * self.stretched[..., None, :]
        beside = (stroke_of_w / softening - stroke)[..., None] * self.carried[..., None, :]
        beside = beside - (compliance * states[SHEAR])[..., None] * self.leaning[..., None, :]
        return self._static(swing, load) / softening[..., None] + beside / self.slowness[..., None, :]

    def right(self, states: Array, still: Array) -> Array:
        """f, from the states and c at the same angles: (..., angles, modes)."""
        held = still + self.swing(states)[..., None] * (still @ self.coupling)
        return held + states[STROKE][..., None] * self.carried[..., None, :]

    def _static(self, swing: Array, load: Array) -> Array:
        """(1 + swing G)^-1 load."""
        rates, turned = np.linalg.eigh(self.coupling)
        return ((load @ turned) / (1.0 + swing[..., None] * rates[..., None, :])) @ turned.mT


def each(strips: tuple[int, ...], function: Callable[..., tuple[Array, ...]], *arrays: ArrayLike) -> tuple[Array, ...]:
    """What a function of one strip gives for several (``strips`` is their number, or nothing for one), side by side:
    so kernels, which take one at a time, serve all."""
    if not strips:
        return function(*arrays)
    found = [function(*(part[k] for part in arrays)) for k in range(strips[0])]
    return tuple(np.stack(part) for part in zip(*found, strict=True))


def _at_the_end(coupling: Array, clamp: Array, shear: Array, head: Array, l: float) -> tuple[Array, ...]:
    """psi', psi and int psi dz at the strip's end for all angles."""
    out, end = np.empty((3, coupling.size)), float(l)
    bend(coupling, clamp, shear, head, end, end, *out)
    return tuple(out)


@kernel
def _static_shape(q: float, l: float, rod_length: float, stations: Array) -> tuple[Array, Array]:
    """g' and g at the stations for the coupling q, without shear."""
    _, _, clamp, shear, head = constants(q, l, rod_length, 0.0)
    one = np.array([[q], [clamp], [shear], [head]])
    slope, value, unused = np.empty(stations.size), np.empty(stations.size), np.empty(1)
    for i in range(stations.size):
        bend(one[0], one[1], one[2], one[3], l, stations[i], unused, slope[i : i + 1], value[i : i + 1])
    return slope, value
