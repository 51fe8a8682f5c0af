"""A thousand realistic rod designs: run time and accuracy.

Machines resemble the example's: every quantity is drawn log-uniformly within a factor of 3 of its value (angles over
the full circle; reciprocating mass and clamp offset, zero there, are added in half of the machines). Bounds scale with
the machine's size; requirements vary around the example's, and one in five limits contact pressure, friction power or
stress as well. The six objectives alternate, and one problem in five has stock thicknesses, steps of width and length,
or both. Some are infeasible. Everything else is default: effects are selected automatically, and the accuracy is 1e-6.

What rivals from twenty starts make of the answers is told in [the campaign](campaign.md).

`python -m bench.rod_problems [COUNT] [--first SEED] [--csv PATH] [--without EFFECT ...]`. Times are processor time.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.designs.flexible_rod.kind import FLEXIBLE_ROD
from app.designs.flexible_rod.request import DesignRequest
from app.designs.kind import Mode
from solvers import rod
from solvers.errors import InvalidInput
from solvers.outcome import EffectState, Outcome

FACTOR = 3.0
STOCK_MM = (0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0)
STEPS_MM = (0.1, 0.25, 0.5)
COUNT = 1000
_WARM = 1_000_000
_SLOW = 3.0
_QUANTILES = (0.5, 0.9, 0.99, 1.0)
_SHOWN = 20


def request(seed: int) -> dict[str, Any]:
    """The design request of a seed."""
    rng, body = np.random.default_rng([seed, 14]), FLEXIBLE_ROD.example(Mode.DESIGN)
    objectives = list(rod.OBJECTIVES)

    def about(value: float, factor: float = FACTOR) -> float:
        return value * factor ** rng.uniform(-0.5, 0.5)

    mechanism = {name: about(value) for name, value in body["mechanism"].items()}
    example = body["piston"]
    piston = {name: about(example[name]) for name in ("diameter_mm", "skirt_length_mm", "friction_coefficient")}
    piston["reciprocating_mass_kg"] = about(0.1) if rng.random() < 0.5 else 0.0
    piston["clamp_offset_mm"] = piston["skirt_length_mm"] * rng.uniform(-0.3, 0.3) if rng.random() < 0.5 else 0.0
    load = {
        "kind": "schmidt",
        "p_min_mpa": about(body["load"]["p_min_mpa"]),
        "delta": about(body["load"]["delta"]),
        "theta_rad": rng.uniform(0.0, 2.0 * math.pi),
    }
    material = {name: about(value) for name, value in body["material"].items() if name != "fatigue_reduction"}
    material["fatigue_reduction"] = 1.0 + about(body["material"]["fatigue_reduction"] - 1.0)
    wide, long = piston["diameter_mm"] / example["diameter_mm"], mechanism["rod_length_mm"] / 45.5
    bounds = {
        name: [about(low * size, 1.5), about(high * size, 1.5)]
        for name, size in (("b_mm", wide), ("h_mm", wide), ("l_mm", long))
        for low, high in [body["bounds"][name]]
    }
    bounds["l_mm"][0] *= 0.5
    bounds["l_mm"][1] = min(bounds["l_mm"][1], mechanism["rod_length_mm"])
    requirements = {"min_fatigue_safety": rng.uniform(1.2, 2.65), "min_stability_safety": rng.uniform(1.2, 3.0)}
    if rng.random() < 0.2:
        limit, value = [
            ("max_contact_pressure_mpa", about(0.1)),
            ("max_friction_power_w", about(0.5)),
            ("min_yield_safety", about(2.0)),
        ][rng.integers(3)]
        requirements[limit] = value
    body |= {"name": f"realistic {seed}", "mechanism": mechanism, "piston": piston, "load": load, "material": material}
    body |= {"requirements": requirements, "bounds": bounds, "objective": objectives[seed % len(objectives)]}
    if rng.random() < 0.2:
        body |= _sizes(rng, bounds)
    return body


def _sizes(rng: np.random.Generator, bounds: dict[str, list[float]]) -> dict[str, Any]:
    """A stock, steps, or both."""
    which, found = rng.integers(3), {}
    stock = [h for h in STOCK_MM if bounds["h_mm"][0] <= h <= bounds["h_mm"][1]]
    if which != 1 and stock:
        found["stock_h_mm"] = stock
    if which != 0:
        found["step_mm"] = {"b": float(rng.choice(STEPS_MM)), "l": float(rng.choice(STEPS_MM))}
    return found


def problem(seed: int) -> rod.RodProblem:
    """The same in SI units."""
    return DesignRequest.model_validate_json(json.dumps(request(seed))).problem()


@dataclass(frozen=True)
class Solved:
    """One problem, and how long it took [s]."""

    seed: int
    seconds: float
    outcome: Outcome[rod.RodDesign] | None
    trouble: str = ""

    @property
    def status(self) -> str:
        return str(self.outcome.status) if self.outcome else "error"

    @property
    def met(self) -> bool:
        """Whether the design, or the diagnosis of an infeasible problem, has the accuracy asked for."""
        return self.outcome is not None and self.outcome.accuracy.met

    @property
    def gap(self) -> float:
        certificate = self.outcome.certificate if self.outcome else None
        return math.nan if certificate is None else certificate.gap


def solved(
    seeds: Iterable[int],
    effects: rod.EffectSelection = rod.AUTO,
    of: Callable[[int], rod.RodProblem] = problem,
) -> Iterator[Solved]:
    """Solve the designs one after the other."""
    for warm in range(_WARM, _WARM + 6):
        rod.design(of(warm), effects)
    for seed in seeds:
        asked, started, outcome, trouble = of(seed), time.process_time(), None, ""
        try:
            outcome = rod.design(asked, effects)
        except (InvalidInput, ArithmeticError, ValueError, RuntimeError) as error:
            trouble = f"{type(error).__name__}: {error}"
        yield Solved(seed, time.process_time() - started, outcome, trouble)


def lines_of(found: Sequence[Solved]) -> list[str]:
    """The page's lines."""
    times = np.array([s.seconds for s in found])
    answers = [s for s in found if s.status == "succeeded"]
    gaps = np.array([s.gap if math.isfinite(s.gap) else math.inf for s in answers])
    share = lambda part, whole: f"{len(part) / len(whole):.1%}" if whole else "none"  # noqa: E731
    quantile = lambda values, q: f"{np.quantile(values, q, method='lower'):.3g}" if len(values) else ""  # noqa: E731
    diagnoses = [s for s in found if s.status == "infeasible"]
    designs = [s for s in found if s.status != "infeasible"]
    missed = [s for s in designs if not s.met]
    statuses = ", ".join(f"{count:,} {status}" for status, count in Counter(s.status for s in found).most_common())
    lines = [
        "| | median | 90 % | 99 % | most |",
        "|---|---|---|---|---|",
        "| time of a design [ms] | " + " | ".join(quantile(1e3 * times, q) for q in _QUANTILES) + " |",
        "| gap of the certificate | " + " | ".join(quantile(gaps, q) for q in _QUANTILES) + " |",
        "",
        f"Of {len(found):,} problems {statuses}; {sum(s.seconds > 1.0 for s in found)} took more than 1 s, "
        f"{sum(s.seconds > _SLOW for s in found)} more than {_SLOW:g} s. The accuracy asked for is met by "
        f"{share([s for s in designs if s.met], designs)} of the designs and by "
        f"{share([s for s in diagnoses if s.met], diagnoses)} of the diagnoses.",
    ]
    for title, seeds in (
        ("Accuracy missed", [s.seed for s in missed]),
        (f"More than {_SLOW:g} s", [s.seed for s in found if s.seconds > _SLOW]),
        ("Errors", [s.seed for s in found if s.trouble]),
    ):
        if seeds:
            more = " …" if seeds[_SHOWN:] else ""
            lines += ["", f"{title}: seeds {', '.join(map(str, seeds[:_SHOWN]))}{more}."]
    return lines


def table(count: int = COUNT) -> list[str]:
    """The page's lines."""
    return lines_of(list(solved(range(count))))


def _record(s: Solved) -> dict[str, Any]:
    """A problem's row of the diagnostic table."""
    o = s.outcome
    d = o.value.check.dimensions if o and o.value else None
    return {
        "seed": s.seed, "objective": problem(s.seed).objective.name, "status": s.status, "seconds": s.seconds,
        "estimated": o.accuracy.estimated if o else "", "gap": s.gap, "trouble": s.trouble,
        "effects": " ".join(e.name for e in o.effects if e.state is EffectState.ACTIVE) if o else "",
        "b": d and d.b, "h": d and d.h, "l": d and d.l,
    }  # fmt: skip


def main() -> None:
    """Print the summary, and write each problem as it finishes if requested."""
    asked = argparse.ArgumentParser(prog="python -m bench.rod_problems", description="realistic designs of the rod")
    asked.add_argument("count", nargs="?", type=int, default=COUNT)
    asked.add_argument("--first", type=int, default=0, help="seed of the first problem")
    asked.add_argument("--csv", type=Path, help="every problem is written there as it is solved")
    asked.add_argument("--without", nargs="*", default=[], metavar="EFFECT", help="effects to leave out")
    given = asked.parse_args()
    found, effects = [], rod.EffectSelection(exclude=frozenset(given.without))
    seeds = range(given.first, given.first + given.count)
    for one in solved(seeds, effects):
        found.append(one)
        if given.csv:
            record, new = _record(one), len(found) == 1
            with given.csv.open("w" if new else "a", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, list(record))
                if new:
                    writer.writeheader()
                writer.writerow(record)
    print("\n".join(lines_of(found)))


if __name__ == "__main__":
    main()
