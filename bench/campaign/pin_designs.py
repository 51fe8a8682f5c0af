"""Random design problems of the pin and the bushing, and shapes that compete with the answer.

A rival is the answer with its walls thickened here and thinned there by a random wave, and all of them together just
enough for the limits to hold; the corners of steps and cones are moved as well.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

import numpy as np

from app.designs.kind import Answer, Mode
from app.designs.pin_profile.kind import PIN_PROFILE
from bench.campaign import pin_profile
from bench.campaign.rivalry import Body, Check, excess

_WAVES, _HALVINGS = 6, 12
RIVALS = f"{_WAVES} random waves of the walls, the lightest that holds by {_HALVINGS} halvings each"
_FINE = 64
_WIDEST = 0.3
"""How far walls are scaled, as a logarithm, in search of the lightest that holds."""
_PIN_FORMS = ("free", "drillable", "constant", "stepped", "double_cone", "cone_cylinder")
_BUSHING_FORMS = ("free", "drillable", "constant", "stepped")


@dataclass(frozen=True)
class PinProblem:
    """A design request of a pin or a bushing."""

    body: Body

    @property
    def sign(self) -> int:
        return 1

    @property
    def _seeks_outside(self) -> bool:
        return self.body.get("variable") == "outer"

    @property
    def _name(self) -> str:
        return "outer_diameter_mm" if self._seeks_outside else "bore_mm"

    def objective(self, result: Body) -> float | None:
        return result["mass_g"]

    def given(self, answer: Answer) -> Body | None:
        if self.body["form"]["kind"] == "constant":
            return self._check(np.zeros(1), np.array([answer.result["profile"][0][self._name]]))
        corners = answer.result["corners"]
        return corners and self._check(*_columns(corners, self._name))

    def _check(self, x: np.ndarray, size: np.ndarray) -> Body:
        bare = {k: v for k, v in self.body.items() if k != "form"}
        if not self._seeks_outside:
            bare.pop("bore_mm", None)
        if 1 < x.size < _FINE:
            # A check looks at its stations, and a cone may touch the least wall between two of them.
            parts = [np.linspace((a, d), (b, e), _FINE) for a, b, d, e in zip(x, x[1:], size, size[1:], strict=False)]
            x, size = np.concatenate([part for part in parts if part[0, 0] < part[-1, 0]]).T
        points = [{"x_mm": a, self._name: d} for a, d in zip(x.tolist(), size.tolist(), strict=True)]
        return {**bare, "profile": points}

    def rivals(self, rng: np.random.Generator, answer: Answer, check: Check) -> None:
        """Per random wave, the lightest that keeps the limits, closed in on by halving."""
        g = self.body["geometry"]
        length = 2 * g["boss_length_mm"] + g["small_end_length_mm"] + 2 * g["gap_mm"]
        if answer.status != "succeeded":
            thickest = 0.0 if not self._seeks_outside else 1e3 * self.body["bore_mm"] + length
            check(self._check(np.zeros(1), np.array([thickest])))
            return
        kind = self.body["form"]["kind"]
        known = answer.result["corners"] or answer.result["profile"]
        x, size = _columns(known, self._name)
        x, size = x[x <= 0.5 * length * (1 + 1e-12)], size[x <= 0.5 * length * (1 + 1e-12)]
        if kind == "constant":
            x, size = x[:1], size[:1]
        for wave in range(_WAVES):
            height, rate, phase = 10 ** rng.uniform(-4.0, -1.0), rng.integers(0, 4), rng.uniform(0.0, 2.0 * math.pi)
            if answer.result["corners"] and kind != "free":
                bent = height * _alike(size, rng) * (wave > 0)
                x = _moved(x, height * (wave > 1), rng)
            else:
                bent = height * np.cos(2.0 * math.pi * rate * x / length + phase) * (wave > 0)
            low, high = -_WIDEST, _WIDEST
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                result = check(self._check(x, self._shaped(size, bent + middle, kind)))
                holds = result is not None and self.broken(result) <= 0.0
                low, high = (low, middle) if holds else (middle, high)

    def _shaped(self, size: np.ndarray, growth: np.ndarray, kind: str) -> np.ndarray:
        """The sizes with walls that many times, as a logarithm, as thick; one-way forms stay one-way."""
        if self._seeks_outside:
            bore = self.body["bore_mm"]
            found = bore + (size - bore) * np.exp(growth)
            return np.maximum.accumulate(found) if kind in ("drillable", "stepped") else found
        outer = self.body["geometry"]["outer_diameter_mm"]
        found = np.maximum(outer - (outer - size) * np.exp(growth), 0.0)
        return np.minimum.accumulate(found) if kind not in ("free", "constant") else found

    def broken(self, result: Body) -> float:
        limits, profile = self.body["limits"], result["profile"]
        wall = min(0.5 * (p["outer_diameter_mm"] - p["bore_mm"]) for p in profile)
        if result["strength_utilisation"] is None or result["deflection_um"] is None:
            return math.inf
        found = [
            excess(result["strength_utilisation"], 1.0),
            excess(limits.get("min_wall_mm"), wall) if limits.get("min_wall_mm") else 0.0,
            excess(result["deflection_um"], limits.get("max_deflection_um")),
        ]
        if limits.get("max_ovalization_um") is not None:
            most = result["ovalization_max_um"]
            found.append(math.inf if most is None else excess(most, limits["max_ovalization_um"]))
        if limits.get("max_slope") is not None:
            x, size = _columns(profile, self._name)
            rise, run = np.abs(np.diff(size)), np.diff(x)
            found.append(float(np.max(np.maximum(rise / (run * limits["max_slope"] + 1e-12 * size.max()) - 1.0, 0.0))))
        return max(found)


def _columns(points: list[Body], name: str) -> tuple[np.ndarray, np.ndarray]:
    return np.array([p["x_mm"] for p in points]), np.array([p[name] for p in points])


def _alike(size: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A random number for every corner, the same where the sizes are."""
    _, number = np.unique(size, return_inverse=True)
    return rng.uniform(-1.0, 1.0, number.max() + 1)[number]


def _moved(x: np.ndarray, by: float, rng: np.random.Generator) -> np.ndarray:
    """The inner corners shifted, those of one step together."""
    places, number = np.unique(x, return_inverse=True)
    shift = by * rng.uniform(-1.0, 1.0, places.size) * (places > places[0]) * (places < places[-1])
    return np.maximum.accumulate(np.minimum((places * (1.0 + shift))[number], x[-1]))


def problem(rng: np.random.Generator) -> PinProblem:
    """A pin or a bushing under a load that a solid one bears, with limits about what it can keep."""
    body = pin_profile.request(rng)
    body.pop("profile", None)
    job = PIN_PROFILE.jobs[Mode.CHECK]
    outside = body.get("variable") == "outer"
    solid = {**body, "limits": {}} if outside else {**body, "bore_mm": 0.0, "limits": {}}
    if outside:
        solid["bore_mm"] = 0.5 * body["geometry"]["outer_diameter_mm"]
    body["bore_mm"] = solid["bore_mm"] if outside else None
    own = job.run(job.request.model_validate_json(json.dumps(solid))).result
    # Strength is used in proportion to the force.
    part = rng.uniform(0.02, 0.98) / own["strength_utilisation"]
    body["load"]["force_n"] *= part
    limits = body["limits"]
    if rng.random() < 0.5:
        limits["min_wall_mm"] = 0.0
    if rng.random() < 0.5:
        limits["max_deflection_um"] = own["deflection_um"] * part * 10 ** rng.uniform(0.01, 0.7)
    if rng.random() < 0.3:
        limits["max_ovalization_um"] = own["ovalization_um"] * part * 10 ** rng.uniform(0.1, 1.5)
    form = str(rng.choice(_BUSHING_FORMS if outside else _PIN_FORMS))
    if form in ("free", "drillable") and not outside and rng.random() < 0.2:
        limits["max_slope"] = 10 ** rng.uniform(-1.5, 0.5)
    body["form"] = {"kind": form, "steps": int(rng.integers(2, 5)) if form == "stepped" else None}
    if outside:
        body["geometry"] = {k: v for k, v in body["geometry"].items() if k != "outer_diameter_mm"}
    return PinProblem(body)
