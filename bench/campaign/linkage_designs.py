"""Random design problems of the impact linkage, and linkages that compete with the answer: the free ratio scanned."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

import numpy as np

from app.designs.impact_linkage.kind import IMPACT_LINKAGE
from app.designs.kind import Answer, Mode
from bench.campaign import impact_linkage
from bench.campaign.rivalry import Body, Check, excess
from solvers.linkage import KINDS
from solvers.linkage.family import GREATEST_MARGIN
from solvers.linkage.kinds import Gain

_RIVALS = 40
RIVALS = f"{_RIVALS} random free ratios of every type, and {_RIVALS} about the answer's own"
_MOST = 1e6
"""What a request may ask for."""
_READ = {
    "box_area": "box_area_mm2",
    "longest_link": "longest_link_mm",
    "enclosing_radius": "enclosing_radius_mm",
    "peak_torque": "peak_torque_nm",
    "pin_force": "pin_force_n",
}
_GREATEST = {
    "longest_link_mm": "longest_link_mm",
    "enclosing_radius_mm": "enclosing_radius_mm",
    "pin_force_n": "max_pin_force_n",
}
"""Results and the limits on them."""


@dataclass(frozen=True)
class LinkageProblem:
    """A design request; speed and frequency are given, so that the free ratio alone is sought, and the type."""

    body: Body
    restitution: float

    @property
    def sign(self) -> int:
        return 1

    def objective(self, result: Body) -> float | None:
        return result[_READ[self.body["objective"]]]

    def given(self, answer: Answer) -> Body:
        name = KINDS[answer.result["type"]].parameter
        return self._check(answer.result["type"], answer.result["ratios"][name])

    def _check(self, name: str, ratio: float) -> Body:
        bare = {k: v for k, v in self.body.items() if k not in ("types", "objective")}
        return {**bare, "type": name, "ratios": {KINDS[name].parameter: ratio}}

    def rivals(self, rng: np.random.Generator, answer: Answer, check: Check) -> None:
        """Every type over its free ratio, as far as a certificate says that it was searched, and the answer's own about
        its own."""
        for name in self.body["types"]:
            kind, gain = KINDS[name], Gain(self.restitution)
            low, high = math.log(kind.least_margin(gain)), math.log(GREATEST_MARGIN)
            for beyond in np.exp(np.sort(rng.uniform(low, high, _RIVALS))):
                check(self._check(name, kind.least_parameter(gain) * (1.0 + float(beyond))))
            if answer.status == "succeeded" and answer.result["type"] == name:
                own = math.log(kind.beyond_least(gain, answer.result["ratios"][kind.parameter]))
                for part in np.geomspace(1e-6, 1e-1, _RIVALS // 2):
                    for near in (own - part, own + part):
                        beyond = math.exp(min(max(near, low), high))
                        check(self._check(name, kind.least_parameter(gain) * (1.0 + beyond)))

    def broken(self, result: Body) -> float:
        limits = self.body["limits"]
        if not result["rotatable"] or result["transmission_angle_deg"] is None:
            return math.inf
        found = [excess(result[name], limits.get(limit)) for name, limit in _GREATEST.items()]
        found.append(excess(limits.get("min_link_mm"), min(result["lengths_mm"].values())))
        if limits["transmission_angle_deg"] is not None:
            least, greatest = limits["transmission_angle_deg"]
            angle = result["transmission_angle_deg"]
            found += [excess(least, angle), excess(angle, greatest)]
        return max(found)


def problem(rng: np.random.Generator) -> LinkageProblem:
    """A blow, some of the types, one objective; limits about what a random linkage has."""
    body = impact_linkage.request(rng)
    job = IMPACT_LINKAGE.jobs[Mode.CHECK]
    own = job.run(job.request.model_validate_json(json.dumps(body))).result
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
        limits["min_link_mm"] = own["longest_link_mm"] * rng.uniform(0.01, 0.2)
    bare = {k: v for k, v in body.items() if k not in ("type", "ratios")}
    return LinkageProblem(
        {**bare, "limits": limits, "types": types, "objective": str(rng.choice(list(_READ)))}, restitution
    )
