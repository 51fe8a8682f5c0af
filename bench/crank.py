"""Forces of a four-stroke cylinder over its cycle, compared with a conventional numpy/scipy implementation.

The conventional way samples the cycle at equal angles, unrolls the diagram with scipy's PCHIP, takes maxima of the
samples, and integrates by the trapezoidal rule. Both compute all forces, the mean torque and the work between the speed
extremes. The error is the maximum relative one of mean torque, crank-pin load, side force and that work; the reference
takes the work from the diagram's antiderivative and the kinetic energy, and refines maxima with scipy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid, trapezoid
from scipy.interpolate import PchipInterpolator
from scipy.optimize import minimize_scalar

from bench.kernels import median_time
from solvers import crank
from solvers.effects import ALL

RADIUS, ROD, SPEED, BORE = 0.04, 0.14, 50.0, 0.08
PISTON, ROD_MASS, CENTRE, INERTIA, THROW = 0.45, 0.6, 0.1, 0.0020, 0.9
AREA = math.pi * BORE**2 / 4
CLEARANCE = AREA * 2 * RADIUS / 8
BACK, PERIOD = 0.1e6, 4 * math.pi
OMEGA = 2 * math.pi * SPEED
SAMPLES = (720, 7_200, 72_000)
NAMES = ("torque_mean", "crank_pin_load", "side_force", "work_fluctuation")


@dataclass(frozen=True)
class Row:
    """One method: median time [s] and maximum relative error of the four results."""

    name: str
    seconds: float
    error: float


def diagram() -> list[tuple[np.ndarray, np.ndarray]]:
    """Volumes and pressures of intake, compression, expansion, exhaust: two polytropes with heat between them."""
    share = 0.5 * (1 - np.cos(np.linspace(0, math.pi, 25)))
    volume = CLEARANCE + AREA * 2 * RADIUS * share
    full = volume[-1]
    burning = np.minimum(volume / CLEARANCE, 1.5)
    expansion = (
        3.0e6 * (1 + 1.2 * (burning - 1)) * np.where(volume > 1.5 * CLEARANCE, 1.5 * CLEARANCE / volume, 1) ** 1.3
    )
    return [
        (volume, np.full(25, 0.09e6)),
        (volume, 0.09e6 * (full / volume) ** 1.35),
        (volume, expansion),
        (volume, np.full(25, 0.11e6)),
    ]


def scene() -> crank.Scene:
    """The same cylinder for the solver."""
    strokes = tuple(crank.Stroke(tuple(v.tolist()), tuple(p.tolist())) for v, p in diagram())
    return crank.Scene(
        crank.Mechanism(RADIUS, ROD, SPEED),
        crank.Cylinder(BORE, CLEARANCE, BACK, 4),
        crank.IndicatorPressure(strokes),
        crank.Masses(PISTON, crank.RodMass(ROD, ROD_MASS, CENTRE, INERTIA), crank.CrankThrow(THROW)),
    )


class Usual:
    """The textbook's formulas on whole arrays."""

    def __init__(self) -> None:
        self.curves = [PchipInterpolator(v, p) for v, p in diagram()]

    def columns(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Torque, crank-pin load and side force."""
        ratio = RADIUS / ROD
        sine, cosine = np.sin(angle), np.cos(angle)
        beta = np.arcsin(ratio * sine)
        x = RADIUS * (1 - cosine) + ROD * (1 - np.cos(beta))
        stroke = np.clip((angle // math.pi).astype(int), 0, 3)
        pressure = np.choose(stroke, [curve(CLEARANCE + AREA * x) for curve in self.curves])
        bend = np.cos(beta)
        acceleration = RADIUS * OMEGA**2 * (
            cosine + ratio * (np.cos(2 * angle) + ratio**2 * sine**4) / bend**3
        )  # fmt: skip
        share = CENTRE / ROD
        axial = (pressure - BACK) * AREA - (PISTON + ROD_MASS * (1 - share)) * acceleration
        turning = (ratio * cosine / bend) ** 2 * np.tan(beta) - ratio * sine / bend
        defect = ROD_MASS * CENTRE * (ROD - CENTRE) - INERTIA
        side = axial * np.tan(beta) + defect * turning * OMEGA**2 / (ROD * bend)
        tangential, radial = axial * sine + side * cosine, axial * cosine - side * sine
        return (
            tangential * RADIUS,
            np.hypot(tangential, radial - ROD_MASS * share * RADIUS * OMEGA**2),
            np.abs(side),
        )

    def analyse(self, samples: int) -> tuple[float, ...]:
        """The four results from equal samples."""
        angle = np.linspace(0, PERIOD, samples + 1)
        torque, load, side = self.columns(angle)
        mean = trapezoid(torque, angle) / PERIOD
        work = cumulative_trapezoid(torque - mean, angle, initial=0)
        return mean, load.max(), side.max(), float(np.ptp(work))

    def climbed(self, column: int) -> float:
        """The greatest value of a column: the best sample, and what scipy finds beside it."""
        grid = np.linspace(0, PERIOD, 72_001)
        values = self.columns(grid)[column]
        best = int(values.argmax())
        bounds = (grid[max(best - 1, 0)], grid[min(best + 1, grid.size - 1)])
        found = minimize_scalar(
            lambda a: -self.columns(np.array([a]))[column][0], bounds=bounds, method="bounded", options={"xatol": 1e-9}
        )
        return max(float(values[best]), -float(found.fun))


def _work(usual: Usual, angle: np.ndarray) -> np.ndarray:
    """Work of the torque since the start [J]: antiderivatives of the strokes, less the kinetic energy gained."""
    ratio = RADIUS / ROD
    beta = np.arcsin(ratio * np.sin(angle))
    x = RADIUS * (1 - np.cos(angle)) + ROD * (1 - np.cos(beta))
    stroke = np.clip((angle // math.pi).astype(int), 0, 3)
    gas = np.zeros_like(angle)
    for index, curve in enumerate(usual.curves):
        whole = curve.antiderivative()
        first = CLEARANCE + (AREA * 2 * RADIUS if index % 2 else 0)
        last = CLEARANCE + (0 if index % 2 else AREA * 2 * RADIUS)
        volume = CLEARANCE + AREA * x
        gas += np.where(stroke == index, whole(volume) - whole(first), 0)
        gas += np.where(stroke > index, whole(last) - whole(first), 0)
    speed = RADIUS * OMEGA * (np.sin(angle) + np.cos(angle) * np.tan(beta))
    turning = ratio * np.cos(angle) / np.cos(beta) * OMEGA
    defect = ROD_MASS * CENTRE * (ROD - CENTRE) - INERTIA
    kinetic = 0.5 * (PISTON + ROD_MASS * (1 - CENTRE / ROD)) * speed**2 - 0.5 * defect * turning**2
    start = -0.5 * defect * (ratio * OMEGA) ** 2
    return gas - BACK * AREA * x - (kinetic - start)


def reference(usual: Usual) -> tuple[float, ...]:
    """The four results by the other way."""
    angle = np.linspace(0, PERIOD, 72_001)
    mean = _work(usual, np.array([PERIOD]))[0] / PERIOD
    swings = []
    for sign in (1.0, -1.0):
        surplus = sign * (_work(usual, angle) - mean * angle)
        best = int(surplus.argmax())
        found = minimize_scalar(
            lambda a, s=sign: -s * (_work(usual, np.array([a]))[0] - mean * a),
            bounds=(angle[max(best - 1, 0)], angle[min(best + 1, angle.size - 1)]),
            method="bounded",
            options={"xatol": 1e-9},
        )
        swings.append(max(float(surplus[best]), -float(found.fun)))
    return mean, usual.climbed(1), usual.climbed(2), sum(swings)


def run() -> list[Row]:
    """Measure both ways."""
    usual, machine = Usual(), scene()
    exact = np.array(reference(usual))

    def error(values: tuple[float, ...]) -> float:
        return float(np.max(np.abs(np.array(values) / exact - 1)))

    def ours(accuracy: float) -> tuple[float, ...]:
        found = crank.analyse(machine, ALL, accuracy=accuracy, series_angles=2).value
        worst = {w.name: w.force for w in found.worst}
        return (
            found.torque_mean,
            worst["crank_pin_load_max"],
            worst["side_force_max"],
            found.speed_fluctuation.work_fluctuation,
        )

    rows = []
    for accuracy in (1e-2, 1e-4, 1e-6, 1e-12):
        name = f"solver, accuracy {accuracy:g}"
        rows.append(Row(name, median_time(lambda a=accuracy: ours(a), 9), error(ours(accuracy))))
    for samples in SAMPLES:
        name = f"numpy and scipy, {samples:,} angles"
        rows.append(Row(name, median_time(lambda n=samples: usual.analyse(n), 9), error(usual.analyse(samples))))
    return rows


def table() -> list[str]:
    """The measurements as lines of Markdown."""
    lines = ["| way | time | greatest relative error |", "|---|---|---|"]
    return lines + [f"| {row.name} | {row.seconds * 1e3:.2f} ms | {row.error:.0e} |" for row in run()]


if __name__ == "__main__":
    print("\n".join(table()))
