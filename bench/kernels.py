"""Stresses over the cycle: the compiled envelope compared with alternative implementations.

The envelope that the optimizers above call (`oracles/`; checks and designs do not use it) is compared with the closed
form in a Python loop, numpy with trigonometry at every section, and scipy's boundary-value solver at its default
tolerance, for one strip at 72 crank angles and 25 sections.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_bvp

from oracles.dense import rod_stress_envelope
from oracles.textbook import rod_beam_column

ANGLES, STATIONS = 72, 25
MODULUS, B, H, LENGTH, ROD = 210e9, 9e-3, 0.46e-3, 23e-3, 45.5e-3
STIFFNESS = MODULUS * B * H**3 / 12


@dataclass(frozen=True)
class Row:
    """One method: median time per (design, angle) [s] and maximum error of V'' relative to its maximum."""

    name: str
    seconds: float
    error: float | None


def machine() -> tuple[np.ndarray, np.ndarray]:
    """Axial force and lateral displacement of the paper's machine at the angles."""
    angle = np.arange(ANGLES) * 2 * math.pi / ANGLES
    pressure = 1.4e6 * 1.25 / (1 - 0.25 * np.cos(angle - 1.16))
    mean = 1.4e6 * 1.25 / math.sqrt(1 - 0.25**2)
    return -(pressure - mean) * math.pi * 0.02**2 / 4, 1.5e-3 * np.sin(angle)


def reference(force: float) -> list[float]:
    """V'' per unit lateral displacement at the stations, from the boundary conditions at 40 digits."""
    import mpmath as mp

    with mp.workdps(40):
        q, l, e = mp.mpf(force) / STIFFNESS, mp.mpf(LENGTH), mp.mpf(ROD) - mp.mpf(LENGTH)
        k = mp.sqrt(-q)
        basis = [lambda z: mp.re(mp.cos(k * z)), lambda z: mp.re(mp.sin(k * z) / k)]
        first = [lambda z: basis[1](z), lambda z: mp.re((1 - mp.cos(k * z)) / k**2)]
        zeroth = [lambda z: first[1](z), lambda z: mp.re((k * z - mp.sin(k * z)) / k**3)]
        third = [lambda z: q * basis[1](z), lambda z: basis[0](z)]
        rows = [[zeroth[i](l) + e * first[i](l) for i in (0, 1)], [basis[i](l) + e * third[i](l) for i in (0, 1)]]
        c, d = mp.lu_solve(mp.matrix(rows), mp.matrix([1, 0]))
        return [float(c * basis[0](z) + d * basis[1](z)) for z in map(mp.mpf, np.linspace(0, LENGTH, STATIONS))]


def python_loop(force: np.ndarray, lateral: np.ndarray) -> np.ndarray:
    """The paper's own formulas, one family per sign of the load, in plain Python: V'' (stations, angles)."""
    out = np.empty((STATIONS, force.size))
    e = ROD - LENGTH
    for i, (p, s) in enumerate(zip(force.tolist(), lateral.tolist(), strict=True)):
        k = math.sqrt(abs(p) / STIFFNESS)
        cos, sin, sign = (math.cos, math.sin, -1) if p < 0 else (math.cosh, math.sinh, 1)
        kl = k * LENGTH
        a11 = sign * (cos(kl) - 1) / k**2 + e * sin(kl) / k
        a12 = sign * (sin(kl) - kl) / k**3 + e * sign * (cos(kl) - 1) / k**2
        a21 = cos(kl) + e * sign * k * sin(kl)
        a22 = sin(kl) / k + e * cos(kl)
        det = a11 * a22 - a12 * a21
        c, d = s * a22 / det, -s * a21 / det
        for j in range(STATIONS):
            z = LENGTH * j / (STATIONS - 1)
            out[j, i] = c * cos(k * z) + d * sin(k * z) / k
    return out


def boundary_value(force: float, lateral: float) -> np.ndarray:
    """scipy's solve_bvp at its default tolerance: V'' at the stations."""
    q, e = force / STIFFNESS, ROD - LENGTH

    def slope(_: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.vstack([y[1], y[2], y[3], q * y[2]])

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array([a[0], a[1], b[0] + e * b[1] - lateral, b[2] + e * b[3]])

    mesh = np.linspace(0, LENGTH, STATIONS)
    return solve_bvp(slope, ends, mesh, np.zeros((4, STATIONS))).sol(mesh)[2]


def median_time(action: Callable[[], object], repeats: int) -> float:
    """Median wall-clock time of one call [s]."""
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        action()
        times.append(time.perf_counter() - started)
    return statistics.median(times)


def run() -> list[Row]:
    """Measure every way, best errors first taken at all angles."""
    force, lateral = machine()
    exact = np.array([reference(f) for f in force]).T
    scale = np.abs(exact).max()
    sections = np.linspace(0, LENGTH, STATIONS)

    def numpy_way() -> np.ndarray:
        return rod_beam_column.curvature(rod_beam_column.solve(force / STIFFNESS, LENGTH, ROD), sections)

    def error(values: np.ndarray) -> float:
        return float(np.abs(values - exact).max() / scale)

    high, low = np.empty((2, STATIONS)), np.empty((2, STATIONS))
    designs = np.tile([B, H, LENGTH], (2000, 1))
    designs[:, 1] *= np.random.default_rng(0).uniform(0.95, 1.3, 2000)
    many_high, many_low = np.empty((2000, 2, STATIONS)), np.empty((2000, 2, STATIONS))
    rod_stress_envelope.warm_up()
    single = lambda: rod_stress_envelope.stress_envelope(force, lateral, MODULUS, B, H, LENGTH, ROD, high, low)  # noqa: E731
    bulk = lambda: rod_stress_envelope.stress_envelopes(force, lateral, MODULUS, designs, ROD, many_high, many_low)  # noqa: E731
    single()
    bending = exact * lateral * 0.5 * MODULUS * H
    stress = force / (B * H) + bending
    envelope_error = float(np.abs(high[0] - stress.max(axis=1)).max() / np.abs(bending).max())
    per_unit = python_loop(force, np.ones_like(lateral))
    by_solver = np.array([boundary_value(f, 1e-3) / 1e-3 for f in force]).T
    return [
        Row("compiled envelope, 2,000 designs", median_time(bulk, 9) / (2000 * ANGLES), envelope_error),
        Row("compiled envelope, one design", median_time(single, 301) / ANGLES, envelope_error),
        Row("numpy, trigonometry at every section", median_time(numpy_way, 51) / ANGLES, error(numpy_way())),
        Row("closed form in a Python loop",
            median_time(lambda: python_loop(force, lateral), 9) / ANGLES, error(per_unit)),
        Row("scipy solve_bvp, default tolerance",
            median_time(lambda: boundary_value(float(force[10]), 1e-3), 21), error(by_solver)),
    ]  # fmt: skip


def table() -> list[str]:
    """The rows of the page."""
    rows = run()
    best = rows[0].seconds
    lines = ["| way | time per (design, angle) | against the best | error of V'' |", "|---|---|---|---|"]
    for row in rows:
        shown = f"{row.seconds * 1e9:,.0f} ns" if row.seconds < 1e-4 else f"{row.seconds * 1e6:,.0f} µs"
        lines.append(f"| {row.name} | {shown} | {row.seconds / best:,.0f} | {row.error:.0e} |")
    return lines
