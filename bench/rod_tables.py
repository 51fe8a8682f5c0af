"""Realistic rod designs under measured pressures: run time and accuracy.

The machines of [realistic rods](#realistic-rods) under tables of 72, 360 or 720 points: Schmidt's cycle, or the turn
around ignition of an engine (compression, heat release by Wiebe's function, expansion, blowdown), without noise or with
0.1 % or 1 % of the greatest pressure, normally distributed at every point. Everything else is default. Checks are those
of the strips in the middle of the bounds.

`python -m bench.rod_tables [COUNT] [--first SEED]`. Times are processor time.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from app.designs.flexible_rod.request import DesignRequest
from bench import rod_problems
from solvers import rod
from solvers.numerics.arrays import Array

COUNT = 36
_FORMS = ("schmidt", "engine")
_POINTS, _NOISE = (72, 360, 720), (0.0, 1e-3, 1e-2)
_COMPRESSION, _POLYTROPIC, _HEAT = 6.0, 1.33, 7.8
"""Of the engine: ratio of volumes, exponent of compression, and the pressure that burning adds, over that at first."""
_IGNITION, _BURNING, _OPENING, _BLOWDOWN = -0.2, 0.9, 2.3, 0.25
"""Angles [rad]: where burning begins, how long it takes, where the exhaust opens, how long until 1/e is left."""
_QUANTILES = (0.5, 0.9, 1.0)


def engine(angle: Array) -> Array:
    """Pressure over that at the beginning of compression, at angles in [-pi, pi) from top dead centre."""
    least = 1.0 / (_COMPRESSION - 1.0)
    volume = least + 0.5 * (1.0 - np.cos(angle))
    burnt = 1.0 - np.exp(-5.0 * (np.maximum(angle - _IGNITION, 0.0) / _BURNING) ** 3)
    pressure = ((least + 1.0) / volume) ** _POLYTROPIC + _HEAT * burnt * (volume / least) ** -1.25
    left = np.exp(-np.maximum(angle - _OPENING, 0.0) / _BLOWDOWN)
    return pressure * left + (1.0 - left)


def request(seed: int) -> dict[str, Any]:
    """The design request of a seed: of every eighteen the first half under Schmidt's cycle."""
    body, rng = rod_problems.request(seed), np.random.default_rng([seed, 15])
    form, points, noise = _FORMS[seed // 9 % 2], _POINTS[seed % 3], _NOISE[seed // 3 % 3]
    load, angle = body["load"], np.arange(points) * 2.0 * math.pi / points
    if form == "schmidt":
        pressure = load["p_min_mpa"] * (1.0 + load["delta"]) / (1.0 - load["delta"] * np.cos(angle - load["theta_rad"]))
    else:
        pressure = 0.12 * load["p_min_mpa"] * engine(np.mod(angle + math.pi, 2.0 * math.pi) - math.pi)
    pressure = pressure + noise * pressure.max() * rng.standard_normal(points)
    table = {"kind": "table", "angle_deg": np.degrees(angle).tolist(), "pressure_mpa": pressure.tolist()}
    return body | {"name": f"{form}, {points} points, noise {noise:g}", "load": table}


def problem(seed: int) -> rod.RodProblem:
    """The same in SI units."""
    return DesignRequest.model_validate_json(json.dumps(request(seed))).problem()


def checked(seeds: Sequence[int]) -> list[tuple[float, bool]]:
    """Of the checks: the time [s], and whether the accuracy is met."""
    out = []
    for seed in seeds:
        asked = problem(seed)
        bounds = asked.bounds
        strip = rod.Dimensions(*(math.sqrt(low * high) for low, high in (bounds.b, bounds.h, bounds.l)))
        rod.check(asked.scene, strip)
        started = time.process_time()
        outcome = rod.check(asked.scene, strip)
        out.append((time.process_time() - started, outcome.accuracy.met))
    return out


def table(count: int = COUNT, first: int = 0) -> list[str]:
    """The page's lines."""
    seeds = range(first, first + count)
    designs = list(rod_problems.solved(seeds, of=problem))
    checks = checked(seeds)
    lines = [
        "| CPU time | median | 90 % | most | accuracy met without noise | with noise |",
        "|---|---|---|---|---|---|",
    ]
    smooth = np.array([_NOISE[seed // 3 % 3] == 0.0 for seed in seeds])
    for name, times, met in (
        ("design", [s.seconds for s in designs], [s.met for s in designs]),
        ("check", [seconds for seconds, _ in checks], [met for _, met in checks]),
    ):
        spent = " | ".join(f"{1e3 * np.quantile(times, q, method='higher'):,.0f} ms" for q in _QUANTILES)
        shares = " | ".join(f"{np.sum(np.array(met)[of])} of {np.sum(of)}" for of in (smooth, ~smooth))
        lines.append(f"| {name} | {spent} | {shares} |")
    slowest = sorted(designs, key=lambda s: -s.seconds)[:3]
    told = ", ".join(f"{s.seed} ({request(s.seed)['name']}: {s.seconds:.1f} s, {s.status})" for s in slowest)
    return [*lines, "", f"The slowest designs: seeds {told}."]


def main() -> None:
    """Print the lines."""
    asked = argparse.ArgumentParser(prog="python -m bench.rod_tables", description="designs under measured pressures")
    asked.add_argument("count", nargs="?", type=int, default=COUNT)
    asked.add_argument("--first", type=int, default=0, help="seed of the first problem")
    given = asked.parse_args()
    print("\n".join(table(given.count, given.first)))


if __name__ == "__main__":
    main()
