"""Reference for the flexible rod: gas load, reciprocating inertia, beam-column, guide and friction.

The deflection is V = A (cos Kz - 1) + B (sin Kz - Kz), or its hyperbolic or cubic counterpart, with A and B from the
two conditions at the head, in the current precision plus the digits lost by cancellation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import mpmath as mp

from solvers.references.monotone_cubic import Cubic
from solvers.references.searching import Number, find_root

Case = Mapping[str, Any]
"""SI units: ``mechanism`` {crank_radius, rod_length, speed}, ``piston``, ``material``, ``dimensions`` {b, h, l},
``load`` (constant, table or schmidt), ``effects`` by name; ``straight`` leaves the axial force out of the bending."""


class BeamColumn:
    """Deflection per unit lateral displacement under one axial force: A and B from the two conditions at the head."""

    def __init__(self, q, l, rod_length):
        x = mp.sqrt(abs(q)) * l
        cancelled = -mp.log10(x) if x > 0 else 0
        self.q, self.k, e = q, mp.sqrt(abs(q)), rod_length - l
        with mp.workdps(mp.mp.dps + 10 + int(max(cancelled, 0) * 10 + x)):
            self.digits = mp.mp.dps
            f, g = self.basis(l)
            a11, a12, a21, a22 = f[0] + e * f[1], g[0] + e * g[1], f[2] + e * f[3], g[2] + e * g[3]
            det = a11 * a22 - a12 * a21
            self.a, self.b = a22 / det, -a21 / det

    def basis(self, z):
        """The two basis functions, which satisfy the clamp conditions, and their first three derivatives at z."""
        q, k = self.q, self.k
        if q == 0:
            return (z**2 / 2, z, mp.mpf(1), mp.mpf(0)), (z**3 / 6, z**2 / 2, z, mp.mpf(1))
        if q < 0:
            c, s = mp.cos_sin(k * z)
            return (c - 1, -k * s, -(k**2) * c, k**3 * s), (s - k * z, k * c - k, -(k**2) * s, -(k**3) * c)
        exponential = mp.exp(k * z)
        c, s = (exponential + 1 / exponential) / 2, (exponential - 1 / exponential) / 2
        return (c - 1, k * s, k**2 * c, k**3 * s), (s - k * z, k * c - k, k**2 * s, k**3 * c)

    def __call__(self, order, z):
        """The derivative of V of this order at z."""
        with mp.workdps(self.digits):
            f, g = self.basis(z)
            return self.a * f[order] + self.b * g[order]


def critical_coupling(l, rod_length):
    """-P_cr/EI [1/m^2], from the first zero of the determinant of the conditions at the head in compression."""
    beta = l / rod_length

    def residual(x):
        return beta**2 * (mp.sin(x) - x * mp.cos(x)) + (1 - beta) * x**2 * mp.sin(x)

    root = mp.findroot(residual, (mp.pi * (1 + mp.mpf(10) ** -30), mp.mpf("4.4934094579090642")), solver="anderson",
                       tol=mp.mpf(10) ** (-2 * mp.mp.dps + 20), verify=False)  # fmt: skip
    return -((root / l) ** 2)


def pchip(angle, values):
    """The periodic monotone cubic interpolant over a revolution, and its mean."""
    revolution = 2 * mp.pi
    curve = Cubic([*angle, angle[0] + revolution], [*values, values[0]], closed=True)

    def value(phi):
        return curve.at(angle[0] + mp.fmod(mp.fmod(phi - angle[0], revolution) + revolution, revolution))[0]

    return value, curve.area[-1] / revolution


class Machine:
    """The machine of a case, in the current precision."""

    def __init__(self, case: Case) -> None:
        groups = {**case["mechanism"], **case["piston"], **case["material"], **case["dimensions"]}
        x = {name: mp.mpf(value) for name, value in groups.items() if value is not None}
        self.x, self.load = x, case["load"]
        self.scale = case.get("pressure_scale", 1)
        self.straight = case.get("straight", False)
        self.stiffness = x["elastic_modulus"] * x["b"] * x["h"] ** 3 / 12
        self.area = mp.pi * x["diameter"] ** 2 / 4
        self.inertia = "reciprocating_inertia" in case["effects"]
        self._pressure, self.mean_pressure = self._source()
        self.back = mp.mpf(0) if self.load["kind"] == "constant" else self.mean_pressure
        if self.load.get("back_pressure") is not None:
            self.back = mp.mpf(self.load["back_pressure"])
        self.bend, self.force, self.lateral = cache(self._bend), cache(self._force), cache(self._lateral)

    def _source(self):
        load = self.load
        if load["kind"] == "constant":
            constant = mp.mpf(load["constant_pressure"])
            return (lambda phi: constant), constant
        if load["kind"] == "table":
            return pchip([mp.mpf(a) for a in load["angle"]], [mp.mpf(p) for p in load["pressure"]])
        p_min, delta, theta = (mp.mpf(load[name]) for name in ("p_min", "delta", "theta"))
        mean = p_min * mp.sqrt((1 + delta) / (1 - delta))
        return (lambda phi: p_min * (1 + delta) / (1 - delta * mp.cos(phi - theta))), mean

    def mean_force(self):
        """Mean axial force over the revolution [N]; the mean of the inertia force is zero."""
        return -self.scale * (self.mean_pressure - self.back) * self.area

    def _force(self, phi):
        value = -self.scale * (self._pressure(phi) - self.back) * self.area
        if self.inertia:
            r, L = self.x["crank_radius"], self.x["rod_length"]
            lam, omega = r / L, 2 * mp.pi * self.x["speed"]
            cos_beta = mp.sqrt(1 - lam**2 * mp.sin(phi) ** 2)
            bracket = mp.cos(phi) + lam * (mp.cos(2 * phi) + lam**2 * mp.sin(phi) ** 4) / cos_beta**3
            value += self.x["reciprocating_mass"] * r * omega**2 * bracket
        return value

    def _bend(self, phi):
        coupling = mp.mpf(0) if self.straight else self.force(phi) / self.stiffness
        return BeamColumn(coupling, self.x["l"], self.x["rod_length"])

    def _lateral(self, phi):
        return self.x["crank_radius"] * mp.sin(phi)

    def stress(self, share, phi, fibre):
        """Stress [Pa] at z = share*l of the fibre +1 or -1."""
        x = self.x
        bending = x["elastic_modulus"] * x["h"] / 2 * self.bend(phi)(2, share * x["l"]) * self.lateral(phi)
        return self.force(phi) / (x["b"] * x["h"]) + fibre * bending

    def deflection(self, share, phi):
        return self.bend(phi)(0, share * self.x["l"]) * self.lateral(phi)

    def side_force(self, phi):
        return -self.stiffness * self.bend(phi)(3, mp.mpf(0)) * self.lateral(phi)

    def clamp_moment(self, phi):
        return self.stiffness * self.bend(phi)(2, mp.mpf(0)) * self.lateral(phi)

    def couple(self, phi):
        """Couple of the guide 6 |M0 + T e|/Lp [N]."""
        moment = self.clamp_moment(phi) + self.side_force(phi) * self.x["clamp_offset"]
        return 6 * abs(moment) / self.x["skirt_length"]

    def contact_pressure(self, phi):
        whole = abs(self.side_force(phi)) + self.couple(phi)
        return 4 * whole / (mp.pi * self.x["diameter"] * self.x["skirt_length"])

    def friction_power(self, phi):
        x = self.x
        side, couple = abs(self.side_force(phi)), self.couple(phi)
        wall = side if couple <= side else (couple + side**2 / couple) / 2
        lam, omega = x["crank_radius"] / x["rod_length"], 2 * mp.pi * x["speed"]
        sine, cosine = mp.sin(phi), mp.cos(phi)
        speed = x["crank_radius"] * omega * sine * (1 + lam * cosine / mp.sqrt(1 - lam**2 * sine**2))
        return x["friction_coefficient"] * 4 / mp.pi * wall * abs(speed)

    def critical_force(self):
        x = self.x
        inertia = x["b"] * x["h"] * min(x["b"], x["h"]) ** 2 / 12
        return -x["elastic_modulus"] * inertia * critical_coupling(x["l"], x["rod_length"])

    def critical_bending(self):
        """Critical force for buckling in the crank's plane [N]."""
        return -self.stiffness * critical_coupling(self.x["l"], self.x["rod_length"])

    def angles(self):
        """Sorted crank angles of one cycle: uniform, and graded towards sharp features."""
        out = {2 * mp.pi * i / 72 for i in range(72)}
        if self.load["kind"] == "table":
            out |= {mp.mpf(a) % (2 * mp.pi) for a in self.load["angle"]}
        centres = [mp.mpf(self.load["theta"])] if self.load["kind"] == "schmidt" and self.load["delta"] > 0.9 else []
        if self.x["crank_radius"] > mp.mpf("0.9") * self.x["rod_length"]:
            centres += [mp.pi / 2, 3 * mp.pi / 2]
        for centre in centres:
            out |= {(centre + s * mp.mpf(10) ** (-mp.mpf(k) / 3)) % (2 * mp.pi) for k in range(1, 24) for s in (-1, 1)}
            out.add(centre % (2 * mp.pi))
        return sorted(out)


def natural_frequency(machine: Machine, force: Number, watch: Callable[[], None]) -> Number:
    """First natural frequency [Hz] under a constant axial force [N]; 0 if the strip buckles.

    EI V'''' - P V'' = rho A omega^2 V has solutions V = A (cosh a z - cos b z) + B (sinh a z / a - sin b z / b), a^2
    and -b^2 the roots of x^2 - P/EI x - rho A omega^2/EI = 0. The frequency is the least root of the determinant of the
    two conditions at the head.
    """
    x, q = machine.x, force / machine.stiffness
    length, rest = x["l"], x["rod_length"] - x["l"]
    inertia_ratio = x["density"] * x["b"] * x["h"] / machine.stiffness

    def determinant(omega: Number) -> Number:
        watch()
        root = mp.sqrt(q * q / 4 + inertia_ratio * omega**2)
        # the root prone to cancellation follows from the product of both
        if q >= 0:
            a2 = root + q / 2
            b2 = inertia_ratio * omega**2 / a2
        else:
            b2 = root - q / 2
            a2 = inertia_ratio * omega**2 / b2
        a, b = mp.sqrt(a2), mp.sqrt(b2)
        c, s = mp.cosh(a * length), mp.sinh(a * length)
        cos, sin = mp.cos_sin(b * length)
        f = (c - cos, a * s + b * sin, a2 * c + b2 * cos, a2 * a * s - b2 * b * sin)
        g = (s / a - sin / b, c - cos, a * s + b * sin, a2 * c + b2 * cos)
        return (f[0] + rest * f[1]) * (g[2] + rest * g[3]) - (g[0] + rest * g[1]) * (f[2] + rest * f[3])

    if force < -machine.critical_bending():
        return mp.mpf(0)
    step = mp.mpf("0.2") / (length * length * mp.sqrt(inertia_ratio)) / 10
    low, start = step / 1000, determinant(step / 1000)
    while True:
        high = low + step
        if determinant(high) * start < 0:
            return find_root(determinant, low, high) / (2 * mp.pi)
        low, step = high, step * mp.mpf("1.05")
