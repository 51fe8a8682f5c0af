"""Random design problems of the flexible rod, and competing strips: random ones, and results of local searches on the
check.

The limits are a random strip's own results with some reserve, or, in one of six, beyond what that strip achieves.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.designs.flexible_rod.kind import FLEXIBLE_ROD
from app.designs.flexible_rod.request import DesignRequest
from app.designs.kind import Answer, Mode
from bench.campaign import flexible_rod
from bench.campaign.rivalry import Body, Field, excess, loosened
from oracles.rivals.hunt import Array, Hunt, Look
from oracles.rivals.rod import ROUGH, compete, core_of, core_optimum, looker, space_of
from oracles.rivals.starts import Strength
from solvers import rod

_RANDOM = 20
SEARCHES = Strength(starts=4, evaluations=60, most=800)
RIVALS = f"{_RANDOM} random strips, and local searches on the check: {SEARCHES}"
_SIZES = ("b_mm", "h_mm", "l_mm")
_READ = {
    "mass": "mass_g",
    "friction_power": "friction_power_w",
    "contact_pressure": "contact_pressure_max_mpa",
    "side_force": "side_force_max_n",
    "fatigue_safety": "fatigue_safety",
    "stability_safety": "stability_safety",
}
_LEAST = {
    "fatigue_safety": "min_fatigue_safety",
    "stability_safety": "min_stability_safety",
    "yield_safety": "min_yield_safety",
}
_LEAST_LIMIT = 1e-6
"""Lower limit of the API."""
_LOOSER = {**dict.fromkeys(_LEAST.values(), -1), "max_contact_pressure_mpa": 1, "max_friction_power_w": 1}
_GREATEST = {"contact_pressure_max_mpa": "max_contact_pressure_mpa", "friction_power_w": "max_friction_power_w"}


@dataclass(frozen=True)
class RodProblem:
    """A design request, and the machine that its checks share."""

    body: Body
    machine: Body

    @property
    def sort(self) -> str:
        stock = ", stock thicknesses" if self.body.get("stock_h_mm") else ""
        return self.body["objective"].replace("_", " ") + stock + (", steps" if self._steps else "")

    @property
    def sign(self) -> int:
        return -1 if self.body["objective"].endswith("safety") else 1

    def objective(self, result: Body) -> float | None:
        return result[_READ[self.body["objective"]]]

    def given(self, answer: Answer) -> Body:
        return {**self.machine, "dimensions": answer.result["dimensions"]}

    def rivals(self, rng: np.random.Generator, answer: Answer, field: Field) -> None:
        """Strips anywhere within the bounds and increasingly close to the answer; then local searches."""
        low, high = np.log(np.array([self.body["bounds"][name] for name in _SIZES]).T)
        found = None if answer.status != "succeeded" else answer.result["dimensions"]
        near = None if found is None else np.log([found[name] for name in _SIZES])
        for turn in range(_RANDOM):
            sizes = rng.uniform(low, high)
            if near is not None and turn % 2:
                sizes = np.clip(near + 10 ** rng.uniform(-4.0, -0.5) * rng.standard_normal(3), low, high)
            dimensions = dict(zip(_SIZES, np.exp(sizes).tolist(), strict=True))
            stock = self.body.get("stock_h_mm")
            if stock:
                dimensions["h_mm"] = min(stock, key=lambda h: abs(h - dimensions["h_mm"]))
            for name, step in self._steps:
                dimensions[name] = round(dimensions[name] / step) * step
            field.check(self._check(dimensions))
        self._search(rng, answer, near, field)

    def _check(self, dimensions: Body) -> Body:
        """Check a strip; the logarithmic round trip may exceed a bound by rounding."""
        bounds = self.body["bounds"]
        within = {n: min(max(dimensions[n], bounds[n][0]), bounds[n][1]) for n in _SIZES}
        return {**self.machine, "dimensions": within}

    def _search(self, rng: np.random.Generator, answer: Answer, near: Array | None, field: Field) -> None:
        """Local searches, in metres."""

        def look(sizes: Array) -> Look:
            result = field.check(self._check(dict(zip(_SIZES, (1e3 * sizes).tolist(), strict=True))), hunt.way)
            return self._seen(result)

        problem = DesignRequest.model_validate_json(json.dumps(self.body)).problem()
        active = frozenset(e["name"] for e in answer.effects if e["state"] == "active")
        selection = rod.EffectSelection(active, frozenset(e["name"] for e in answer.effects) - active)
        hunt = Hunt(space_of(problem), look, seeking=near is not None)
        first = None if near is None else near - math.log(1e3)
        rough = looker(problem, core_of(selection), ROUGH)
        compete(hunt, first, core_optimum(problem, selection), rough, field.strength or SEARCHES, rng)

    def _seen(self, result: Body | None) -> Look:
        """Evaluation of a checked result for the searches."""
        asked = self.body["requirements"]
        if result is None or (result["fatigue_safety"] is None and result["stability_safety"] is None):
            result = dict.fromkeys([*_LEAST, *_GREATEST, *_READ.values()])
        margins = [_log(result[n], asked[limit]) for n, limit in _LEAST.items() if limit in asked]
        margins += [_log(asked[limit], result[n]) for n, limit in _GREATEST.items() if limit in asked]
        margins.append(_log(result["stability_safety"], 1.0))
        return Look(self.sign * _log(self.objective(result), 1.0, math.inf * self.sign), np.array(margins))

    def neighbours(self, steps: Sequence[float]) -> Iterator[tuple[str, float, RodProblem]]:
        for name, share, body in loosened(self.body, "requirements", _LOOSER, steps):
            yield name, share, RodProblem(body, self.machine)

    def wider(self) -> Iterator[RodProblem]:
        for name in ("stock_h_mm", "step_mm"):
            if self.body.get(name):
                yield RodProblem({k: v for k, v in self.body.items() if k != name}, self.machine)

    def broken(self, result: Body) -> float:
        asked = self.body["requirements"]
        if result["fatigue_safety"] is None and result["stability_safety"] is None:
            return math.inf
        found = [excess(asked.get(limit), result[name]) for name, limit in _LEAST.items() if result[name] is not None]
        found += [excess(result[name], asked.get(limit)) for name, limit in _GREATEST.items()]
        if result["stability_safety"] is not None and result["stability_safety"] <= 1.0:
            found.append(math.inf)
        # searches first ignore the stock of thicknesses
        stock, h = self.body.get("stock_h_mm"), result["dimensions"]["h_mm"]
        if stock and not any(math.isclose(h, one, rel_tol=1e-9) for one in stock):
            found.append(math.inf)
        for name, step in self._steps:
            size = result["dimensions"][name]
            if not math.isclose(size, round(size / step) * step, rel_tol=1e-9):
                found.append(math.inf)
        return max(found, default=0.0)

    @property
    def _steps(self) -> list[tuple[str, float]]:
        """Sizes on a grid [mm], with their steps."""
        return [(f"{name}_mm", step) for name, step in (self.body.get("step_mm") or {}).items() if step]


def _log(value: float | None, other: float | None, missing: float = math.nan) -> float:
    return math.log(value / other) if value and other else missing


def problem(rng: np.random.Generator) -> RodProblem:
    """A problem around a random strip in its machine, redrawn until the strip bears its load."""
    job = FLEXIBLE_ROD.jobs[Mode.CHECK]
    while True:
        machine: dict[str, Any] = flexible_rod.request(rng)
        own = job.run(job.request.model_validate_json(json.dumps({**machine, "accuracy": 1e-4})))
        if own.status == "succeeded" and own.result["fatigue_safety"] and own.result["stability_safety"]:
            break
    strip, length = machine.pop("dimensions"), machine["mechanism"]["rod_length_mm"]
    reach = {"b_mm": (0.5, 1.8), "h_mm": (0.4, 2.5), "l_mm": (0.4, 1.9)}
    bounds = {
        n: [strip[n] * rng.uniform(low, 1.0), strip[n] * rng.uniform(1.0, high)] for n, (low, high) in reach.items()
    }
    bounds["l_mm"][1] = min(bounds["l_mm"][1], length)
    asks = 3.0 if rng.random() < 1 / 6 else 1.0
    requirements = {
        "min_fatigue_safety": own.result["fatigue_safety"] * rng.uniform(0.6, 0.97) * asks,
        "min_stability_safety": max(own.result["stability_safety"] * rng.uniform(0.6, 0.97), 1.01),
    }
    for name, limit in _GREATEST.items():
        if rng.random() < 0.3 and own.result[name]:
            requirements[limit] = max(own.result[name] / rng.uniform(0.6, 0.97), _LEAST_LIMIT)
    if rng.random() < 0.3 and own.result["yield_safety"]:
        requirements["min_yield_safety"] = own.result["yield_safety"] * rng.uniform(0.6, 0.97)
    objectives = [n for n in _READ if machine["piston"]["friction_coefficient"] > 0 or n != "friction_power"]
    body = {**machine, "requirements": requirements, "bounds": bounds, "objective": str(rng.choice(objectives))}
    if rng.random() < 0.2:
        body["stock_h_mm"] = sorted(rng.uniform(*bounds["h_mm"], 6).tolist())
    # a separate random stream, so that all other draws are unaffected
    other = rng.spawn(1)[0]
    if other.random() < 0.15:
        body["step_mm"] = {n: (bounds[f"{n}_mm"][1] - bounds[f"{n}_mm"][0]) / other.uniform(4.0, 40.0) for n in "bl"}
    return RodProblem(body, machine)
