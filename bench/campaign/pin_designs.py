"""Random design problems of pins and bushings, and competing shapes: everything the form allows, searched locally on
the check (``oracles.rivals.pin``)."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from app.designs.kind import Answer, Mode
from app.designs.pin_profile.kind import PIN_PROFILE
from app.designs.pin_profile.request import DesignRequest
from app.designs.units import MILLI
from bench.campaign import pin_profile
from bench.campaign.rivalry import Body, Field, excess, loosened
from oracles.rivals.pin import Bushing, Part, Shape, pin_of, rival_shapes
from oracles.rivals.starts import Strength
from solvers.effects import EffectSelection

SEARCHES = Strength(starts=21, evaluations=30, ways=("SLSQP", "COBYQA", "Nelder-Mead"), most=2000)
RIVALS = (
    "steps along the limits, and local searches on the check over all that the form allows, halves unlike included: "
    f"{SEARCHES}"
)
_FINE = 64
_PIN_FORMS = ("free", "drillable", "constant", "stepped", "double_cone", "cone_cylinder")
_BUSHING_FORMS = ("free", "drillable", "constant", "stepped")
_LOOSER = {"min_wall_mm": -1, "max_deflection_um": 1, "max_ovalization_um": 1, "max_slope": 1, "max_ring_stress_mpa": 1}
_WIDER = {
    "drillable": ("free",),
    "constant": ("stepped", "double_cone"),
    "stepped": ("stepped", "drillable"),
    "double_cone": ("cone_cylinder",),
    "cone_cylinder": ("free",),
}
"""Forms that include another form, those with more steps among them."""


@dataclass(frozen=True)
class PinProblem:
    """A design request of a pin or a bushing."""

    body: Body

    @property
    def sort(self) -> str:
        limits = self.body["limits"]
        beside = " beside deflection" if limits.get("max_deflection_um") else ""
        slope = f", slope{beside}" if limits.get("max_slope") else ", deflection" if beside else ""
        part = "bushing" if self._seeks_outside else "pin"
        return f"{part}, {self.body['form']['kind'].replace('_', ' ')}{slope}"

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
            # the check evaluates stations, and a cone may touch the minimum wall between two of them
            parts = [np.linspace((a, d), (b, e), _FINE) for a, b, d, e in zip(x, x[1:], size, size[1:], strict=False)]
            x, size = np.concatenate([part for part in parts if part[0, 0] < part[-1, 0]]).T
        points = [{"x_mm": a, self._name: d} for a, d in zip(x.tolist(), size.tolist(), strict=True)]
        return {**bare, "profile": points}

    def rivals(self, rng: np.random.Generator, answer: Answer, field: Field) -> None:
        """Local searches in metres, whose results are rechecked."""
        g = self.body["geometry"]
        length = 2 * g["boss_length_mm"] + g["small_end_length_mm"] + 2 * g["gap_mm"]
        if answer.status != "succeeded":
            thickest = 0.0 if not self._seeks_outside else 1e3 * self.body["bore_mm"] + length
            field.check(self._check(np.zeros(1), np.array([thickest])), "the thickest")
            return
        x, size = _columns(answer.result["corners"] or answer.result["profile"], self._name)
        first = x <= 0.5 * length * (1 + 1e-12)
        own = Shape(MILLI * x[first], MILLI * np.abs(self._other - size[first]))
        form, part = self.body["form"], self._part(answer)
        for found in rival_shapes(
            part, form["kind"], int(form.get("steps") or 0), own, field.strength or SEARCHES, rng
        ):
            field.tried += found.tried
            if found.shape is not None:
                size = part.size(found.shape.wall) / MILLI
                field.check(self._check(found.shape.x / MILLI, size), found.by)

    def _part(self, answer: Answer) -> Part:
        """The pin or the bushing, with the effects of the answer."""
        request = DesignRequest.model_validate_json(json.dumps(self.body))
        active = frozenset(e["name"] for e in answer.effects if e["state"] == "active")
        selection = EffectSelection(active, frozenset(e["name"] for e in answer.effects) - active)
        if self._seeks_outside:
            return Bushing(request.problem(), selection)
        return pin_of(request.problem(), selection)

    @property
    def _other(self) -> float:
        """The given diameter [mm]."""
        return self.body["bore_mm"] if self._seeks_outside else self.body["geometry"]["outer_diameter_mm"]

    def neighbours(self, steps: Sequence[float]) -> Iterator[tuple[str, float, PinProblem]]:
        for name, share, body in loosened(self.body, "limits", _LOOSER, steps):
            yield name, share, PinProblem(body)

    def wider(self) -> Iterator[PinProblem]:
        form = self.body["form"]
        for kind in _WIDER.get(form["kind"], ()):
            steps = int(form.get("steps") or 1) + 1 if kind == "stepped" else None
            slope_of_steps = kind == "stepped" and self.body["limits"].get("max_slope")
            if not slope_of_steps and not (self._seeks_outside and kind not in _BUSHING_FORMS):
                yield PinProblem({**self.body, "form": {"kind": kind, "steps": steps}})

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
        if limits.get("max_ring_stress_mpa") is not None:
            most = result["ovalization_stress_max_mpa"]
            found.append(math.inf if most is None else excess(most, limits["max_ring_stress_mpa"]))
        if limits.get("max_slope") is not None:
            x, size = _columns(profile, self._name)
            rise, run = np.abs(np.diff(size)), np.diff(x)
            found.append(float(np.max(np.maximum(rise / (run * limits["max_slope"] + 1e-12 * size.max()) - 1.0, 0.0))))
        return max(found)


def _columns(points: list[Body], name: str) -> tuple[np.ndarray, np.ndarray]:
    return np.array([p["x_mm"] for p in points]), np.array([p[name] for p in points])


def problem(rng: np.random.Generator) -> PinProblem:
    """A pin or bushing with a load that a solid one bears, and limits around what it can meet; one pin in eight is
    close to the limit of a solid pin, on either side."""
    body = pin_profile.request(rng)
    body.pop("profile", None)
    job = PIN_PROFILE.jobs[Mode.CHECK]
    outside = body.get("variable") == "outer"
    solid = {**body, "limits": {}} if outside else {**body, "bore_mm": 0.0, "limits": {}}
    if outside:
        solid["bore_mm"] = 0.5 * body["geometry"]["outer_diameter_mm"]
    body["bore_mm"] = solid["bore_mm"] if outside else None
    own = job.run(job.request.model_validate_json(json.dumps(solid))).result
    # utilisation is proportional to the force
    part = rng.uniform(0.02, 0.98) / own["strength_utilisation"]
    body["load"]["force_n"] *= part
    limits = body["limits"]
    if rng.random() < 0.5:
        limits["min_wall_mm"] = 0.0
    if rng.random() < 0.5:
        limits["max_deflection_um"] = own["deflection_um"] * part * 10 ** rng.uniform(0.01, 0.7)
    if rng.random() < 0.3:
        limits["max_ovalization_um"] = own["ovalization_um"] * part * 10 ** rng.uniform(0.1, 1.5)
    # a separate random stream, so that all other draws are unaffected
    other = rng.spawn(1)[0]
    if other.random() < 0.15:
        limits["max_ring_stress_mpa"] = own["ovalization_stress_max_mpa"] * part * 10 ** other.uniform(0.1, 1.0)
    if not outside and other.random() < 0.125:
        if other.random() < 0.5:
            body["load"]["force_n"] *= 10 ** other.uniform(-0.02, 0.02) / part / own["strength_utilisation"]
            limits.update(max_deflection_um=None, max_ovalization_um=None, max_ring_stress_mpa=None)
        else:
            limits["max_deflection_um"] = own["deflection_um"] * part * 10 ** other.uniform(-0.05, 0.02)
    form = str(rng.choice(_BUSHING_FORMS if outside else _PIN_FORMS))
    if form in ("free", "drillable") and not outside and rng.random() < 0.2:
        limits["max_slope"] = 10 ** rng.uniform(-1.5, 0.5)
    body["form"] = {"kind": form, "steps": int(rng.integers(2, 5)) if form == "stepped" else None}
    if outside:
        body["geometry"] = {k: v for k, v in body["geometry"].items() if k != "outer_diameter_mm"}
    return PinProblem(body)
