"""A piston pin: bulk profiles, the deflection limit, and steps, compared with root finders and a modelling language.

The pin is the paper's, at 1,000 stations. The free profile is compared with scipy's brentq at every station. The
deflection limit (bending only, which the alternatives can express directly) is compared with cvxpy and Clarabel, from
scratch and re-solved with the limit as a parameter; masses are compared with an independent lower bound from tangents
of the Lagrangian. Times are processor time. With shear, the program is not accepted by the modelling language in this
form.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from app.designs.pictures.chart import BLUE, RED, Chart, decades_around
from solvers import pin
from solvers.pin.effects import Physics
from solvers.pin.optimum.conic import slope_limited_optimum
from solvers.pin.optimum.dual_bound import pointwise_bound
from solvers.pin.optimum.lagrangian import minimum_volume
from solvers.pin.optimum.program import Program, assemble
from solvers.pin.stations.lobatto_panels import NODES, Stations, initial_stations

STATIONS = 1_000
FORCE, BENDING_LIMIT, LIMIT = 15e3, 6.785153977e-6, 11.22302193e-6
SCENE = pin.Scene(pin.Geometry(21.99e-3, 24e-3, 30e-3, 1e-3), FORCE, pin.PinMaterial(150e6, 210e9, 0.3, 7850.0))
CRITERION = pin.CRITERIA["tresca_paper"]
PICTURE = Path(__file__).parents[1] / "docs" / "pin-accuracy.svg"


@dataclass(frozen=True)
class Row:
    """One method: median processor time [s], stations, and distance of its mass from the bound or the exact value."""

    task: str
    name: str
    seconds: float
    stations: int
    error: float


def median_time(action: Callable[[], object], repeats: int) -> float:
    """Median processor time of one call [s], after one that warms up."""
    action()
    times = []
    for _ in range(repeats):
        started = time.process_time()
        action()
        times.append(time.process_time() - started)
    return statistics.median(times)


def by_brentq(x: np.ndarray) -> np.ndarray:
    """Bores at the stations, one call of brentq each, on the paper's equation 1 - beta^4 = F(beta)."""
    from scipy.optimize import brentq

    a, b, gap, D, sigma = 24e-3, 30e-3, 1e-3, 21.99e-3, 150e6
    out = np.empty_like(x)
    for i, place in enumerate(x.tolist()):
        t = place - a - gap
        if place <= a:
            shear, moment = FORCE * place**2 / (2 * a * a), FORCE * place**3 / (6 * a * a)
        else:
            shear = FORCE / 2 - (FORCE * t / b if t > 0 else 0.0)
            moment = FORCE * a / 6 + FORCE / 2 * (place - a) - (FORCE * t * t / (2 * b) if t > 0 else 0.0)
        m, q = 32 * moment / (math.pi * sigma * D**3), 32 * abs(shear) / (3 * math.pi * sigma * D**2)

        def short(beta: float, m: float = m, q: float = q) -> float:
            return 1 - beta**4 - math.sqrt(m * m + (q * (1 + beta + beta * beta)) ** 2)

        out[i] = brentq(short, 0.0, 1.0, xtol=1e-14) * D if m or q else D
    return out


def program_of(stations: int, limit: float, shear: bool) -> Program:
    """The pin's program on about ``count`` stations."""
    panels = initial_stations(SCENE)
    while panels.x.size < stations:
        widest = np.argsort(panels.left - panels.right, kind="stable")[: max(1, (stations - panels.x.size) // NODES)]
        which = np.zeros(panels.left.size, dtype=bool)
        which[widest] = True
        panels = panels.halved(which)
    return assemble(SCENE, pin.Limits(max_deflection=limit), CRITERION, Physics(shear_deflection=shear), panels)


class Modelled:
    """The same program as a user writes it for cvxpy: reciprocals of u and 2 - u, everything relative."""

    def __init__(self, program: Program) -> None:
        import cvxpy as cp

        self.program, self.cp = program, cp
        self.limit = cp.Parameter(nonneg=True, value=1.0)
        self.u = cp.Variable(program.lower.size)
        pulls = program.bending > 0
        weight = 0.5 * program.weight[pulls] * program.bending[pulls] / program.limit
        inside = self.u[np.flatnonzero(pulls)]
        bent = cp.sum(cp.multiply(weight, cp.inv_pos(inside) + cp.inv_pos(2 - inside)))
        self.problem = cp.Problem(
            cp.Minimize(program.weight @ self.u), [self.u >= program.lower, self.u <= 1, bent <= self.limit]
        )

    def solve(self, limit: float = 1.0) -> np.ndarray:
        self.limit.value = limit
        self.problem.solve(solver=self.cp.CLARABEL, tol_gap_abs=1e-10, tol_gap_rel=1e-10, tol_feas=1e-10)
        return self.u.value


def _above(program: Program, u: np.ndarray) -> float:
    """How far a profile is from the bound of its program, or its deflection from the limit: whichever is more."""
    found = minimum_volume(program, program.lower, False)
    bound = pointwise_bound(program, program.lower, found.multiplier, found.solidity)
    return max(abs(program.volume(u) / bound - 1.0), program.deflection(np.maximum(u, 1e-300)) / program.limit - 1.0)


def run() -> list[Row]:
    """Every way, warmed up, one after another."""
    x = np.linspace(0.0, 0.04, STATIONS)
    ours, theirs = pin.free_sizes(SCENE, CRITERION, FORCE, x), by_brentq(x)
    many = np.linspace(0.0, 0.04, 100_000)
    apart = float(np.abs(theirs / ours - 1.0).max())
    rows = [
        Row("free profile", "this, 1,000 stations",
            median_time(lambda: pin.free_sizes(SCENE, CRITERION, FORCE, x), 201), STATIONS, apart),
        Row("free profile", "this, 1,000 stations of a new pin",
            median_time(lambda: pin.free_sizes(replace(SCENE), CRITERION, FORCE, x), 201), STATIONS, apart),
        Row("free profile", "this, 100,000 stations",
            median_time(lambda: pin.free_sizes(SCENE, CRITERION, FORCE, many), 21), many.size, apart),
        Row("free profile", "brentq at every station", median_time(lambda: by_brentq(x), 7), STATIONS, apart),
    ]  # fmt: skip
    program = program_of(STATIONS, BENDING_LIMIT, shear=False)
    n = program.lower.size
    found = minimum_volume(program, program.lower, False)
    model = Modelled(program)
    limits = iter(np.tile([1.0, 1.01, 0.99], 100))
    rows += [
        Row("deflection limit", "this: one multiplier",
            median_time(lambda: minimum_volume(program, program.lower, False), 101), n,
            _above(program, found.solidity)),
        Row("deflection limit", "this, with its bound",
            median_time(lambda: _certified(program), 51), n, _above(program, found.solidity)),
        Row("deflection limit", "cvxpy + Clarabel from nothing",
            median_time(lambda: Modelled(program).solve(), 5), n, _above(program, Modelled(program).solve())),
        Row("deflection limit", "cvxpy + Clarabel re-solved",
            median_time(lambda: model.solve(next(limits)), 7), n, _above(program, model.solve())),
    ]  # fmt: skip
    sheared = program_of(STATIONS, LIMIT, shear=True)
    full = minimum_volume(sheared, sheared.lower, False)
    cone = slope_limited_optimum(sheared, sheared.lower, False, 1e-9)
    rows += [
        Row("deflection limit with shear", "this: one multiplier",
            median_time(lambda: minimum_volume(sheared, sheared.lower, False), 101), n, _above(sheared, full.solidity)),
        Row("deflection limit with shear", "this: cone program, a few rounds",
            median_time(lambda: slope_limited_optimum(sheared, sheared.lower, False, 1e-9), 3), n,
            _above(sheared, cone.solidity)),
    ]  # fmt: skip
    for steps in (2, 3, 4):
        problem = pin.PinProblem(SCENE, form=pin.Stepped(steps))
        outcome = pin.design(problem)
        rows.append(
            Row("whole design", f"{steps} steps, with bound and check",
                median_time(lambda p=problem: pin.design(p), 11), outcome.accuracy.settings["stations"],
                outcome.certificate.gap)
        )  # fmt: skip
    problem = pin.PinProblem(SCENE, pin.Limits(max_deflection=LIMIT))
    outcome = pin.design(problem)
    rows.append(
        Row("whole design", "free, deflection limit with shear", median_time(lambda: pin.design(problem), 21),
            outcome.accuracy.settings["stations"], outcome.certificate.gap)
    )  # fmt: skip
    return rows


def _certified(program: Program) -> float:
    found = minimum_volume(program, program.lower, False)
    return pointwise_bound(program, program.lower, found.multiplier, found.solidity)


def accuracy_rows() -> list[Row]:
    """Error of the mass over the number of stations, evenly spread and adapted, and by tier."""
    problem = pin.PinProblem(SCENE, pin.Limits(max_deflection=LIMIT))
    exact = pin.design(problem, accuracy=1e-12).value.check.mass
    rows = []
    for accuracy in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
        outcome = pin.design(problem, accuracy=accuracy)
        error = abs(outcome.value.check.mass / exact - 1.0)
        seconds = median_time(lambda a=accuracy: pin.design(problem, accuracy=a), 11)
        rows.append(
            Row("adapted panels", f"{accuracy:.0e} asked", seconds, outcome.accuracy.settings["stations"], error)
        )
    for stations in (25, 50, 100, 200, 400, 800, 1600):
        program = even(stations)
        for name, solve, repeats in (
            ("multiplier", lambda p: minimum_volume(p, p.lower, False).solidity, 21),
            (
                "cone program",
                lambda p: slope_limited_optimum(p, p.lower, False, 1e-8).solidity,
                1 if stations > 400 else 3,
            ),
        ):
            if name == "cone program" and stations > 800:
                continue
            mass = program.mass_unit * program.volume(solve(program))
            seconds = median_time(lambda s=solve, p=program: s(p), repeats)
            rows.append(Row(f"midpoints, {name}", "", seconds, stations, abs(mass / exact - 1.0)))
    return rows


@dataclass(eq=False)
class Midpoints(Stations):
    """Evenly spread stations, as a user without Lobatto's rule takes them: one in the middle of every panel."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.x = self.side = 0.5 * (self.left + self.right)
        self.weight = self.width / self.span

    def error_estimate(self, values: np.ndarray) -> np.ndarray:
        return np.zeros_like(values)


def even(stations: int) -> Program:
    """The program on midpoints of equal panels."""
    edges = np.linspace(0.0, 0.04, stations + 1)
    limits = pin.Limits(max_deflection=LIMIT)
    return assemble(SCENE, limits, CRITERION, Physics(), Midpoints(edges))


def draw(rows: list[Row]) -> None:
    """docs/pin-accuracy.svg: error against time."""
    times, errors = [row.seconds * 1e3 for row in rows], [max(row.error, 1e-15) for row in rows]
    chart = Chart(
        "A pin with a deflection limit: error against time",
        decades_around(times),
        decades_around(errors),
        "processor time, median of the runs, ms",
        "relative error of the mass",
    )
    for row, seconds, error in zip(rows, times, errors, strict=True):
        chart.mark(seconds, error, row.name or str(row.stations), RED if "cone" in row.task else BLUE)
    PICTURE.write_text(chart.svg(), "utf-8")


def table() -> list[str]:
    """The page's lines."""
    rows = run()
    lines = ["| task | way | time | per station | stations | from the bound |", "|---|---|---|---|---|---|"]
    for row in rows:
        whole = f"{row.seconds * 1e3:,.3g} ms"
        lines.append(
            f"| {row.task} | {row.name} | {whole} | {row.seconds / row.stations * 1e9:,.0f} ns | {row.stations:,} | "
            f"{row.error:.0e} |"
        )
    by = {(row.task, row.name): row.seconds for row in rows}
    free = by["free profile", "brentq at every station"]
    known, new = (free / by["free profile", f"this, 1,000 stations{which}"] for which in ("", " of a new pin"))
    ways = [by["deflection limit", f"this{way}"] for way in (": one multiplier", ", with its bound")]
    cold, cold_bound = (by["deflection limit", "cvxpy + Clarabel from nothing"] / way for way in ways)
    again, again_bound = (by["deflection limit", "cvxpy + Clarabel re-solved"] / way for way in ways)
    lines += [
        "",
        f"Against brentq the profile is {known:,.0f} times faster ({new:,.0f} times with the loads of a pin not seen "
        f"before); against cvxpy the deflection limit {cold:,.0f} times from nothing and {again:,.0f} times re-solved, "
        f"with its own bound, which the peers do not give, {cold_bound:,.0f} and {again_bound:,.0f} times. (For the "
        "free profile the last column is the difference from brentq.)",
        "",
        "What the number of stations and the way to solve cost, for the same pin with shear (![error against time]"
        "(pin-accuracy.svg)):",
        "",
        "| stations | way | time | relative error of the mass |",
        "|---|---|---|---|",
    ]
    rows = accuracy_rows()
    draw(rows)
    for row in rows:
        words = f"{row.task}, {row.name}" if row.name else row.task
        lines.append(f"| {row.stations:,} | {words} | {row.seconds * 1e3:,.3g} ms | {row.error:.0e} |")
    return lines


if __name__ == "__main__":
    print("\n".join(table()))
