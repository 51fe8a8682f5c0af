"""The rod with its effects, densely sampled: closed forms in numpy at arbitrary angles and sections, Schmidt's load
only.

    psi = C S1(z) + D S2(z),  V' = psi/m - g D,  q_s = q/m,  m = 1 + g q,  q = P/EI,  S_k = z^k c_k(-q_s z^2)

shear               g = EI/(kGA); g = 0 without it
friction_feedback   P = P0 + sign(s) mu (4/pi) int |q_wall| ds, the root closest to P0, by a bracketing solver
large_displacement  theta_3'' - q theta_3 - k_3 = f = -q theta^3/6 - k theta^2/2 with theta = V', k = Q/EI, by variation
                    of constants: theta_3' = A S0 + k_3 S1 + int_0^z S0(z - x) f(x) dx, the integral by Gauss' rule
rod_inertia         see ``rod_vibration``

Extremes are taken from a grid and refined in successively smaller windows around its best points; the friction power by
Gauss' rule between the corners of the wall force. Validity: strips that do not buckle, sqrt(q) l up to about 12.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.optimize import brentq, elementwise

from oracles.dense.rod_vibration import PeriodicMotion, periodic_motion
from solvers.rod.scene import Dimensions, Scene

Array = NDArray[np.float64]
TURN = 2.0 * math.pi
ANGLES, SECTIONS = 720, 81
_GAUSS_NODES, _GAUSS_WEIGHTS = (lambda x, w: (0.5 * (x + 1.0), 0.5 * w))(*legendre.leggauss(28))
_PANEL, _PANEL_WEIGHTS = legendre.leggauss(16)
_ROUNDS, _SHRINK = 18, 0.4


def stumpff(t: Array) -> tuple[Array, Array, Array, Array]:
    """c0 … c3 by complex trigonometry for t of either sign; c3 by its series where the difference would cancel."""
    x = np.sqrt(t + 0j)
    safe = np.where(np.abs(x) < 1e-8, 1.0, x)
    c1 = np.where(np.abs(x) < 1e-8, 1.0, np.sin(safe) / safe).real
    half = np.where(np.abs(x) < 1e-8, 1.0, np.sin(0.5 * safe) / (0.5 * safe)).real
    small = np.abs(t) < 2.0
    u = np.where(small, t, 0.0)
    series = np.zeros_like(u)
    for j in range(11, -1, -1):
        series = series * -u + 1.0 / math.factorial(2 * j + 3)
    far = np.where(small, 1.0, x)
    return np.cos(x).real, c1, 0.5 * half**2, np.where(small, series, ((far - np.sin(far)) / far**3).real)


def families(q: Array, z: Array) -> tuple[Array, Array, Array, Array]:
    """S0 … S3 at z, broadcast."""
    c0, c1, c2, c3 = stumpff(-q * z * z)
    return c0, z * c1, z * z * c2, z**3 * c3


@dataclass(frozen=True)
class Bent:
    """The state of the strip at n angles; every field has the shape (n,): phi [rad], P [N], s [m], q_s [1/m^2], m, s C
    [1/m], s D [1/m^2]; A [1/m] and k_3 [1/m^2] of the large displacement; T [N] and M0 [N m] with all effects."""

    angle: Array
    force: Array
    lateral: Array
    scaled: Array
    softening: Array
    clamp: Array
    shear: Array
    third_clamp: Array
    third_shear: Array
    side: Array
    moment: Array


@dataclass(frozen=True)
class RodModel:
    """A strip in its machine with the given effects, in addition to gas load, beam-column and friction."""

    scene: Scene
    strip: Dimensions
    effects: frozenset[str] = frozenset()

    @cached_property
    def stiffness(self) -> float:
        return self.scene.material.elastic_modulus * self.strip.b * self.strip.h**3 / 12.0

    @cached_property
    def compliance(self) -> float:
        if "shear" not in self.effects:
            return 0.0
        return self.stiffness / (5.0 / 6.0 * self.scene.material.shear_modulus * self.strip.b * self.strip.h)

    @property
    def head(self) -> float:
        return self.scene.mechanism.rod_length - self.strip.l

    def gas_force(self, angle: Array) -> Array:
        """P0 [N] of Schmidt's cycle against its mean pressure."""
        load = self.scene.load
        back = load.p_min * (1 + load.delta) / math.sqrt(1 - load.delta**2)
        pressure = load.p_min * (1 + load.delta) / (1 - load.delta * np.cos(angle - load.theta))
        return -(pressure - back) * math.pi * self.scene.piston.diameter**2 / 4

    def lateral(self, angle: Array) -> Array:
        return self.scene.mechanism.crank_radius * np.sin(angle)

    def constants(self, force: Array, compliance: float) -> tuple[Array, Array, Array, Array]:
        """q_s, m, C and D per unit lateral displacement."""
        q, l, e = force / self.stiffness, self.strip.l, self.head
        m = 1.0 + compliance * q
        c0, c1, c2, c3 = stumpff(-q / m * l * l)
        turned = c0 + e * q * l * c1
        det = l**3 * (c2 - c3) / m + e * l * (l + m * e) * c1 + compliance * l * turned
        return q / m, m, (l * c1 + e * m * c0) / det, -turned / det

    def wall(self, side: Array, moment: Array) -> Array:
        """int |q_wall| ds over the skirt [N]."""
        piston = self.scene.piston
        side, couple = np.abs(side), 6.0 * np.abs(moment + side * piston.clamp_offset) / piston.skirt_length
        both = couple > side
        return np.where(both, 0.5 * (couple + side**2 / np.where(both, couple, 1.0)), side)

    def friction(self, force: Array, lateral: Array) -> Array:
        """Friction's contribution to the axial force when that is ``force`` [N]."""
        _, m, clamp, shear = self.constants(force, self.compliance)
        side, moment = -self.stiffness * m * shear * lateral, self.stiffness * clamp * lateral
        return np.sign(lateral) * self.scene.piston.friction_coefficient * 4.0 / math.pi * self.wall(side, moment)

    def axial_force(self, angle: Array) -> Array:
        """P [N] with friction feedback: from P0 outward in growing steps, then bracketed."""
        before, lateral = self.gas_force(angle), self.lateral(angle)
        if "friction_feedback" not in self.effects:
            return before
        first = self.friction(before, lateral)
        idle = np.abs(first) <= 1e-15 * np.abs(before)
        first = np.where(idle, 1.0, first)
        # in units of the first step, so that one tolerance fits all angles
        found = elementwise.bracket_root(self._gap, 0.0, 1.0, args=(before, lateral, first), factor=1.3)
        root = elementwise.find_root(
            self._gap, found.bracket, args=(before, lateral, first), tolerances={"xatol": 1e-15, "xrtol": 4e-16}
        )
        if not np.all(found.success | idle):
            raise ArithmeticError("friction buckles the strip")
        return np.where(idle, before, before + root.x * first)

    def _gap(self, x: Array, before: Array, lateral: Array, first: Array) -> Array:
        return x - self.friction(before + x * first, lateral) / first

    def bent(self, angle: Array, force: Array | None = None) -> Bent:
        """The state at the angles (n,), under this model's axial force [N] or a given one."""
        force, lateral = self.axial_force(angle) if force is None else force, self.lateral(angle)
        scaled, m, clamp, shear = self.constants(force, self.compliance)
        clamp, shear = clamp * lateral, shear * lateral
        zero = np.zeros_like(force)
        side, moment = -self.stiffness * m * shear, self.stiffness * clamp
        found = Bent(angle, force, lateral, scaled, m, clamp, shear, zero, zero, side, moment)
        third = zero, zero
        if "large_displacement" in self.effects:
            third = self._third_constants(found)
            side, moment = side - self.stiffness * third[1], moment + self.stiffness * third[0]
        if "rod_inertia" in self.effects:
            _, _, still_clamp, still_shear = self.constants(force, 0.0)
            curvature, rate = self.motion.at_clamp(angle)
            side = side - self.stiffness * (rate - still_shear * lateral)
            moment = moment + self.stiffness * (curvature - still_clamp * lateral)
        return Bent(angle, force, lateral, scaled, m, clamp, shear, *third, side, moment)

    def slope(self, bent: Bent, z: Array) -> Array:
        """V' of the linear strip; z broadcasts against (angles,)."""
        _, s1, s2, _ = families(bent.scaled, z)
        return (bent.clamp * s1 + bent.shear * s2) / bent.softening - self.compliance * bent.shear

    def deflection(self, bent: Bent, z: Array) -> Array:
        """V of the linear strip [m]."""
        _, _, s2, s3 = families(bent.scaled, z)
        return (bent.clamp * s2 + bent.shear * s3) / bent.softening - self.compliance * bent.shear * z

    def curvature(self, bent: Bent, z: Array) -> Array:
        """psi' with all corrections [1/m]."""
        s0, s1, _, _ = families(bent.scaled, z)
        out = bent.clamp * s0 + bent.shear * s1
        if "large_displacement" in self.effects:
            s0, s1, _, _ = families(bent.force / self.stiffness, z)
            out = out + bent.third_clamp * s0 + bent.third_shear * s1 + self._convolved(bent, z, 0)
        if "rod_inertia" in self.effects:
            q, _, clamp, shear = self.constants(bent.force, 0.0)
            s0, s1, _, _ = families(q, z)
            out = out + self.motion.curvature(bent.angle, z) - (clamp * s0 + shear * s1) * bent.lateral
        return out

    def tangent_force(self, bent: Bent, z: Array) -> Array:
        """N along the strip's tangent [N]."""
        if "large_displacement" not in self.effects:
            return np.broadcast_to(bent.force, np.broadcast_shapes(bent.force.shape, np.shape(z)))
        slope = self.slope(bent, z)
        return bent.force * (1.0 - 0.5 * slope**2) - self.stiffness * bent.softening * bent.shear * slope

    def _load(self, bent: Bent, z: Array) -> Array:
        """f of the third-order equation."""
        slope = self.slope(bent, z)
        q = bent.force / self.stiffness
        return -slope * slope * (q * slope / 6.0 + 0.5 * bent.softening * bent.shear)

    def _convolved(self, bent: Bent, z: Array, order: int) -> Array:
        """int_0^z S_order(z - x) f(x) dx."""
        z, total = np.asarray(z, dtype=float), 0.0
        for node, weight in zip(_GAUSS_NODES, _GAUSS_WEIGHTS, strict=True):
            kernel = families(bent.force / self.stiffness, z * (1.0 - node))[order]
            total = total + weight * kernel * self._load(bent, z * node)
        return z * total

    def _third_constants(self, bent: Bent) -> tuple[Array, Array]:
        """A and k_3 from the offset and the moment of the pin."""
        l, e, q = np.array(self.strip.l), self.head, bent.force / self.stiffness
        s0, s1, s2, s3 = families(q, l)
        by = [self._convolved(bent, l, order) for order in (0, 1, 2)]
        cube = sum(w * self.slope(bent, l * x) ** 3 for x, w in zip(_GAUSS_NODES, _GAUSS_WEIGHTS, strict=True)) * l / 6
        offset = by[2] - cube + e * (by[1] - self.slope(bent, l) ** 3 / 6.0)
        moment = by[0] + e * (q * by[1] + self._load(bent, l))
        a, b, c, d = s2 + e * s1, s3 + e * s2, s0 + e * q * s1, s1 + e * (q * s2 + 1.0)
        det = a * d - b * c
        return (b * moment - d * offset) / det, (c * offset - a * moment) / det

    @cached_property
    def motion(self) -> PeriodicMotion:
        """The moving strip under this model's axial force; shear deflection, independent of the force, moves as
        well."""
        return periodic_motion(self)

    # Judged results

    def severity(self, high: Array, low: Array) -> Array:
        """Serensen's equivalent stress [Pa]; the fatigue safety is the fatigue limit divided by it."""
        m = self.scene.material
        return m.fatigue_reduction * 0.5 * (high - low) + m.mean_stress_sensitivity * np.maximum(
            0.5 * (high + low), 0.0
        )

    def stress(self, bent: Bent, z: Array, fibre: int) -> Array:
        d, modulus = self.strip, self.scene.material.elastic_modulus
        return self.tangent_force(bent, z) / (d.b * d.h) + fibre * 0.5 * modulus * d.h * self.curvature(bent, z)

    def judged(self) -> dict[str, float]:
        """Fatigue safety, greatest side force [N] and mean friction power [W]."""
        return {
            "fatigue_safety": self.fatigue_safety(),
            "side_force_max_n": self.greatest_side_force(),
            "friction_power_w": self.friction_power(),
        }

    @cached_property
    def _grid(self) -> Bent:
        return self.bent(np.arange(ANGLES) * TURN / ANGLES)

    def greatest_side_force(self) -> float:
        return max(_zoomed(lambda a, sign=sign: sign * self.bent(a).side, sign * self._grid.side) for sign in (1, -1))

    def fatigue_safety(self) -> float:
        sections = np.linspace(0.0, self.strip.l, SECTIONS)
        worst = 0.0
        tables = {f: np.stack([self.stress(self._grid, z, f) for z in sections]) for f in (1, -1)}
        rows = {f: self.severity(s.max(axis=1), s.min(axis=1)) for f, s in tables.items()}
        top = max(row.max() for row in rows.values())
        for fibre, row in rows.items():
            padded = np.concatenate([[-np.inf], row, [-np.inf]])
            for i in np.flatnonzero((row >= padded[:-2]) & (row >= padded[2:]) & (row > 0.97 * top)):
                worst = max(worst, self._climbed(fibre, sections[i], tables[fibre][i]))
        return self.scene.material.fatigue_limit / worst

    def _climbed(self, fibre: int, section: float, values: Array) -> float:
        """The peak near a grid section, in shrinking windows of section and of both extremes' angles."""
        step, width = TURN / ANGLES, self.strip.l / (SECTIONS - 1)
        highs, lows, best = _tops(values) * step, _tops(-values) * step, 0.0
        offsets = np.linspace(-1.0, 1.0, 9)
        for _ in range(_ROUNDS):
            z = np.clip(section + width * offsets, 0.0, self.strip.l)[:, None]
            upper = self.stress(self.bent((highs[:, None] + step * offsets).ravel()), z, fibre)
            lower = self.stress(self.bent((lows[:, None] + step * offsets).ravel()), z, fibre)
            found = self.severity(upper.max(axis=1), lower.min(axis=1))
            i = int(found.argmax())
            best, section = max(best, float(found[i])), float(z[i, 0])
            highs = highs + step * offsets[upper[i].reshape(highs.size, -1).argmax(axis=1)]
            lows = lows + step * offsets[lower[i].reshape(lows.size, -1).argmin(axis=1)]
            step, width = step * _SHRINK, width * _SHRINK
        return best

    def friction_power(self) -> float:
        """Mean of mu (4/pi) int |q_wall| ds |v|."""
        corners = self.corners(lambda a: self.bent(a))
        ends = np.unique(np.concatenate([np.arange(49) * TURN / 48, corners]))
        half = 0.5 * np.diff(ends)
        angle = (0.5 * (ends[1:] + ends[:-1])[:, None] + half[:, None] * _PANEL).ravel()
        bent = self.bent(angle)
        power = self.power_at(angle, bent.side, bent.moment)
        return float(half @ (power.reshape(half.size, -1) @ _PANEL_WEIGHTS)) / TURN

    def power_at(self, angle: Array, side: Array, moment: Array) -> Array:
        """Friction power [W] at the angles under T [N] and M0 [N m]."""
        m = self.scene.mechanism
        ratio, sine = m.crank_radius / m.rod_length, np.sin(angle)
        speed = TURN * m.speed * m.crank_radius * sine * (1 + ratio * np.cos(angle) / np.sqrt(1 - (ratio * sine) ** 2))
        wall = self.scene.piston.friction_coefficient * 4.0 / math.pi * self.wall(side, moment)
        return wall * np.abs(speed)

    def force_corners(self) -> Array:
        """Angles at which the axial force has a corner."""
        return self.corners(self.still) if "friction_feedback" in self.effects else np.empty(0)

    def corners(self, at: Callable[[Array], Bent]) -> Array:
        """Angles at which contact changes between one wall and both."""
        piston = self.scene.piston

        def excess(angle: Array) -> Array:
            bent = at(angle)
            couple = 6.0 * (bent.moment + bent.side * piston.clamp_offset) / piston.skirt_length
            return np.stack([couple - bent.side, couple + bent.side])

        # denser near the dead centres, where a moving strip's reactions vanish one after the other
        near = np.geomspace(1e-9, 0.05, 120)
        grid = np.concatenate([np.arange(ANGLES) * TURN / ANGLES + 1e-4, *(c + s * near for c in (0.0, math.pi, TURN)
                               for s in (1, -1))])  # fmt: skip
        grid = np.sort(grid[(grid > 0.0) & (grid < TURN)])
        values, found = excess(grid), []
        for row in (0, 1):
            for i in np.flatnonzero(values[row, 1:] * values[row, :-1] < 0):
                found.append(
                    brentq(lambda a, row=row: float(excess(np.array([a]))[row, 0]), grid[i], grid[i + 1], xtol=1e-13)
                )
        return np.array(sorted(found))

    def still(self, angle: Array) -> Bent:
        """The linear quasi-static strip, whose reactions determine the friction."""
        return RodModel(self.scene, self.strip, self.effects & {"shear", "friction_feedback"}).bent(angle)


def _tops(values: Array) -> Array:
    """Indices of local maxima of a periodic row close to its greatest value."""
    humps = (values >= np.roll(values, 1)) & (values >= np.roll(values, -1))
    return np.flatnonzero(humps & (values >= values.max() - 2e-3 * np.ptp(values)))


def _zoomed(function: Callable[[Array], Array], grid: Array) -> float:
    """The maximum over the cycle, starting from the grid's values."""
    step, places, offsets = TURN / ANGLES, _tops(grid) * TURN / ANGLES, np.linspace(-1.0, 1.0, 9)
    best = float(grid.max())
    for _ in range(_ROUNDS):
        values = function((places[:, None] + step * offsets).ravel()).reshape(places.size, -1)
        best = max(best, float(values.max()))
        places = places + step * offsets[values.argmax(axis=1)]
        step *= _SHRINK
    return best
