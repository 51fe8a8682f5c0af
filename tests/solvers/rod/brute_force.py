"""The core model solved again, slowly and by other means: dense sampling and bounded searches, nothing shared.

The beam is written with complex trigonometry (one formula for tension and compression, no Stumpff functions), extremes
are searched on dense grids that are drawn together, section by section by scipy's bounded scalar search.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

ANGLES = 1440
SECTIONS = 201


class CoreModel:
    """Gas load, beam-column and guide of one machine with one strip; Schmidt's load only."""

    def __init__(self, scene, dimensions) -> None:
        self.scene, self.d = scene, dimensions
        self.stiffness = scene.material.elastic_modulus * dimensions.b * dimensions.h**3 / 12

    def force(self, angle):
        load = self.scene.load
        back = load.p_min * (1 + load.delta) / np.sqrt(1 - load.delta**2)
        pressure = load.p_min * (1 + load.delta) / (1 - load.delta * np.cos(angle - load.theta))
        return -(pressure - back) * np.pi * self.scene.piston.diameter**2 / 4

    def _constants(self, angle):
        l, L = self.d.l, self.scene.mechanism.rod_length
        k = np.sqrt(-self.force(angle) / self.stiffness + 0j)
        s0, s1 = np.cos(k * l), np.sin(k * l) / k
        s2, s3 = (1 - s0) / k**2, (k * l - np.sin(k * l)) / k**3
        a = np.array([[s2 + (L - l) * s1, s3 + (L - l) * s2], [s0 - (L - l) * k**2 * s1, s1 + (L - l) * s0]])
        det = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
        lateral = self.scene.mechanism.crank_radius * np.sin(angle)
        return k, lateral * a[1, 1] / det, -lateral * a[1, 0] / det

    def curvature(self, z, angle):
        k, c, d = self._constants(angle)
        return np.real(c * np.cos(k * z) + d * np.sin(k * z) / k)

    def deflection(self, z, angle):
        k, c, d = self._constants(angle)
        return np.real(c * (1 - np.cos(k * z)) / k**2 + d * (k * z - np.sin(k * z)) / k**3)

    def side_force(self, angle):
        return -self.stiffness * np.real(self._constants(angle)[2])

    def clamp_moment(self, angle):
        return self.stiffness * np.real(self._constants(angle)[1])

    def stress(self, z, angle, fibre):
        d, modulus = self.d, self.scene.material.elastic_modulus
        return self.force(angle) / (d.b * d.h) + fibre * 0.5 * modulus * d.h * self.curvature(z, angle)

    def contact_pressure(self, angle):
        p = self.scene.piston
        side = self.side_force(angle)
        skew = 6 * np.abs(self.clamp_moment(angle) + side * p.clamp_offset) / p.skirt_length
        return 4 / (np.pi * p.diameter * p.skirt_length) * (np.abs(side) + skew)

    def section(self, z, fibre):
        """Greatest and least stress of one fibre at one section."""
        high = greatest(lambda a: self.stress(z, a, fibre))
        return high, -greatest(lambda a: -self.stress(z, a, fibre))

    def worst(self, severity):
        """The greatest ``severity(high, low)`` over both fibres and all sections."""
        angle = np.arange(ANGLES) * 2 * np.pi / ANGLES
        sections = np.linspace(0.0, self.d.l, SECTIONS)
        best = -np.inf
        for fibre in (1, -1):
            coarse = np.array([self.stress(z, angle, fibre) for z in sections])
            row = np.array([severity(s.max(), s.min()) for s in coarse])
            padded = np.concatenate([[-np.inf], row, [-np.inf]])
            peaks = np.flatnonzero((row >= padded[:-2]) & (row >= padded[2:]))
            for i in peaks[row[peaks] > 0.97 * row.max()]:
                low, high = sections[max(i - 1, 0)], sections[min(i + 1, SECTIONS - 1)]
                found = minimize_scalar(
                    lambda z, f=fibre: -severity(*self.section(z, f)),
                    bounds=(low, high), method="bounded", options={"xatol": 1e-7 * self.d.l},
                )  # fmt: skip
                best = max(best, -found.fun, severity(*self.section(sections[i], fibre)))
        return best


def greatest(function):
    """The maximum over one turn: a dense grid, then grids sixteen times as fine in turn around every hump near the
    top."""
    step = 2 * np.pi / ANGLES
    angle = np.arange(ANGLES) * step
    values = function(angle)
    humps = np.flatnonzero((values >= np.roll(values, 1)) & (values >= np.roll(values, -1)))
    best = values.max()
    for i in humps[values[humps] >= best - 1e-3 * np.abs(values).max()]:
        low, high = angle[i] - step, angle[i] + step
        for _ in range(4):
            near = np.linspace(low, high, 33)
            there = function(near)
            k = int(there.argmax())
            best, low, high = max(best, there[k]), near[max(k - 1, 0)], near[min(k + 1, 32)]
    return best
