"""Random design problems of the impact linkage, and competing linkages: every type over its free ratio and, if free,
its size, scanned and searched locally on the check (``oracles.rivals.linkage``)."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from app.designs.impact_linkage.kind import IMPACT_LINKAGE, SQUARE_MILLI
from app.designs.impact_linkage.request import DesignRequest
from app.designs.kind import Answer, Mode
from app.designs.units import MILLI
from bench.campaign import impact_linkage
from bench.campaign.rivalry import Body, Field, excess, loosened
from oracles.rivals.linkage import rivals
from oracles.rivals.starts import Strength
from solvers import linkage
from solvers.linkage import KINDS

SEARCHES = Strength(starts=21, evaluations=20, ways=("SLSQP", "COBYQA", "Nelder-Mead"), most=1200)
_SCANNED = 40
RIVALS = (
    f"of every type {_SCANNED} members from end to end and a thousand times closer to both, the best closed in on, "
    f"steps along the limits, and local searches on the check: {SEARCHES}"
)
_MOST = 0.9e6
"""Upper limit of the API, with reserve for relaxed limits."""
_READ = {
    "box_area": "box_area_mm2",
    "longest_link": "longest_link_mm",
    "enclosing_radius": "enclosing_radius_mm",
    "peak_torque": "peak_torque_nm",
    "pin_force": "pin_force_n",
    "impact_speed": "impact_speed_m_s",
    "blow_frequency": "blow_frequency_hz",
}
_SOUGHT = ("impact_speed", "blow_frequency")
"""Objectives for which the motion is free."""
_UNITS = {"box_area": SQUARE_MILLI, "longest_link": MILLI, "enclosing_radius": MILLI}
_GREATEST = {
    "longest_link_mm": "longest_link_mm",
    "enclosing_radius_mm": "enclosing_radius_mm",
    "pin_force_n": "max_pin_force_n",
}
"""Results and their limits."""
_LOOSER = {"min_link_mm": -1, "width_mm": 1, "height_mm": 1, **dict.fromkeys(_GREATEST.values(), 1)}


@dataclass(frozen=True)
class LinkageProblem:
    """A design request: type and free ratio are variables, with a tool at a given radius, or speed or frequency and
    thus the size variable as well."""

    body: Body
    restitution: float

    @property
    def sort(self) -> str:
        tool = ", tool at its own radius" if self.body.get("tool_radius_mm") else ""
        return self.body["objective"].replace("_", " ") + tool

    @property
    def sign(self) -> int:
        return -1 if self.body["objective"] in _SOUGHT else 1

    @property
    def _sized(self) -> bool:
        """Whether speed and frequency determine the size."""
        return self.body["objective"] not in _SOUGHT and self.body.get("tool_radius_mm") is None

    def objective(self, result: Body) -> float | None:
        return result[_READ[self.body["objective"]]]

    def given(self, answer: Answer) -> Body:
        if self._sized:
            name = answer.result["type"]
            parameter = KINDS[name].parameter
            return {**self._bare, "type": name, "ratios": {parameter: answer.result["ratios"][parameter]}}
        timed = {name: answer.result[name] for name in ("blow_frequency_hz", "impact_speed_m_s")}
        return {**self._bare, **timed, "type": answer.result["type"], "lengths_mm": answer.result["lengths_mm"]}

    @property
    def _bare(self) -> Body:
        return {k: v for k, v in self.body.items() if k not in ("types", "objective")}

    def rivals(self, rng: np.random.Generator, answer: Answer, field: Field) -> None:
        """Every type over all free parameters."""
        request = DesignRequest.model_validate_json(json.dumps(self.body))
        problem = request.problem()
        own = linkage.design(problem).value if answer.status == "succeeded" else None
        unit = _UNITS.get(self.body["objective"], 1.0)
        for best in rivals(problem, own, field.strength or SEARCHES, rng, _SCANNED):
            field.tried += best.tried
            if best.cost is not None:
                # a search for any feasible linkage has no cost
                value = math.exp(best.cost) / unit if own is not None else 1.0
                field.enter(value, f"{best.kind}, {best.found_by}")

    def broken(self, result: Body) -> float:
        limits = self.body["limits"]
        if not result["rotatable"] or result["transmission_angle_deg"] is None:
            return math.inf
        found = [excess(result[name], limits.get(limit)) for name, limit in _GREATEST.items()]
        found.append(excess(limits.get("min_link_mm"), min(result["lengths_mm"].values())))
        found += [excess(result["box_mm"][s], limits.get(f"{s}_mm")) for s in ("width", "height") if result["box_mm"]]
        if limits["transmission_angle_deg"] is not None:
            least, greatest = limits["transmission_angle_deg"]
            angle = result["transmission_angle_deg"]
            found += [excess(least, angle), excess(angle, greatest)]
        # requests are decimal: rounding of lengths is disregarded
        return max(max(found) - _DECIMAL, 0.0)

    def neighbours(self, steps: Sequence[float]) -> Iterator[tuple[str, float, LinkageProblem]]:
        for name, share, body in loosened(self.body, "limits", _LOOSER, steps):
            yield name, share, LinkageProblem(body, self.restitution)

    def wider(self) -> Iterator[LinkageProblem]:
        if len(self.body["types"]) < len(KINDS):
            yield LinkageProblem({**self.body, "types": list(KINDS)}, self.restitution)


_DECIMAL = 1e-11


def problem(rng: np.random.Generator) -> LinkageProblem:
    """A blow, some types, one objective; limits around a random linkage's results."""
    body = impact_linkage.request(rng)
    job = IMPACT_LINKAGE.jobs[Mode.CHECK]
    own = job.run(job.request.model_validate_json(json.dumps({**body, "effects": "all"}))).result
    types = [name for name in KINDS if rng.random() < 0.7] or [body["type"]]
    restitution = body["restitution"]
    if isinstance(restitution, dict):
        restitution = 0.5 * (restitution["low"] + restitution["high"])
    limits = {**body["limits"], "transmission_angle_deg": None if rng.random() < 0.3 else [40.0, 140.0]}
    for name, limit in _GREATEST.items():
        if rng.random() < 0.25 and own[name] and own[name] < 0.5 * _MOST:
            limits[limit] = own[name] * rng.uniform(0.7, 1.5) + (
                limits["joint_radius_mm"] if "radius" in limit else 0.0
            )
    if rng.random() < 0.3:
        limits["min_link_mm"] = min(own["longest_link_mm"] * rng.uniform(0.01, 0.2), _MOST)
    bare = {k: v for k, v in body.items() if k not in ("type", "ratios")}
    bare |= {"limits": limits, "types": types, "objective": str(rng.choice(list(_READ)))}
    if own["box_mm"] and rng.random() < 0.25:
        for side in ("width", "height"):
            if rng.random() < 0.7:
                limits[f"{side}_mm"] = min(own["box_mm"][side] * rng.uniform(0.8, 1.6), _MOST)
    if rng.random() < 0.2:
        # around the random linkage's restitution, so that its type has a member
        bare["tool_radius_mm"] = min(own["lengths_mm"]["rocker"] * rng.uniform(0.8, 1.25), _MOST)
    if bare["objective"] in _SOUGHT or bare.get("tool_radius_mm"):
        limits.setdefault("longest_link_mm", min(own["longest_link_mm"] * rng.uniform(0.7, 1.5), _MOST))
        limits.setdefault("min_link_mm", min(own["longest_link_mm"] * rng.uniform(0.001, 0.1), _MOST))
        if bare["objective"] in _SOUGHT:
            bare[f"{bare['objective']}_{'m_s' if bare['objective'] == 'impact_speed' else 'hz'}"] = None
            bare.pop("drive", None)
    return LinkageProblem(bare, restitution)
