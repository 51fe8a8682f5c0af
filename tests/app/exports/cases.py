"""Runs of every kind as JSON objects, scaled and renamed as needed."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from app.designs.kind import Mode
from app.designs.registry import KINDS

HOSTILE = (
    '=cmd|"/c calc"!A1', "+1+1", "-2+3", "@SUM(A1)", "\t=1", "a,b;c\"d\"\r\ne", "</svg><script>alert(1)</script>",
    "%%c %%u ^J \\P {\\fArial}", "]]>&amp;\u202e gnp.exe", "Kröpfung № 7 曲軸", "x" * 200,
)  # fmt: skip


@cache
def _solved(slug: str, mode: Mode, more: str) -> str:
    kind = KINDS[slug]
    job = kind.jobs[mode]
    request = job.request.model_validate_json(json.dumps({**kind.example(mode), **json.loads(more)}))
    answer = job.run(request)
    return json.dumps(
        {
            "id": "0123456789abcdef", "kind": slug, "mode": str(mode), "status": answer.status, "name": "a part",
            "created_at": "2026-01-31T12:00:00+00:00", "spec_hash": "f" * 64,
            "spec": json.loads(request.model_dump_json()), "result": answer.result, "verdict": answer.verdict,
            "effects": answer.effects, "accuracy": answer.accuracy, "problem": None, "timing": {}, "links": {},
            "solver": {"name": "crankwright", "version": "1"},
        }
    )  # fmt: skip


def solved(slug: str, mode: Mode, **more: Any) -> dict[str, Any]:
    """A run of the kind's example with changed fields."""
    return json.loads(_solved(slug, mode, json.dumps(more)))


def bushing(form: str = "free", **more: Any) -> dict[str, Any]:
    geometry = {**KINDS["pin-profile"].example(Mode.DESIGN)["geometry"], "outer_diameter_mm": None}
    steps = {"kind": form} | ({"steps": 3} if form == "stepped" else {})
    return solved("pin-profile", Mode.DESIGN, variable="outer", bore_mm=14, geometry=geometry, form=steps, **more)


def parts() -> dict[str, dict[str, Any]]:
    """A run for every shape of part."""
    forms = ("free", "drillable", "constant", "double_cone", "cone_cylinder")
    pins = {form: solved("pin-profile", Mode.DESIGN, form={"kind": form}) for form in forms}
    return {
        "strip": solved("flexible-rod", Mode.CHECK),
        **pins,
        "stepped": solved("pin-profile", Mode.DESIGN),
        "bushing": bushing(),
        **{f"{form} bushing": bushing(form) for form in ("constant", "drillable", "stepped")},
        "linkage": solved("impact-linkage", Mode.CHECK),
    }


def scaled(found: Any, factor: float, name: str = "") -> Any:
    """The run with all lengths scaled; slopes unchanged, mass cubed."""
    if isinstance(found, dict):
        return {key: scaled(value, factor, name if name == "lengths_mm" else key) for key, value in found.items()}
    if isinstance(found, list):
        return [scaled(value, factor, name) for value in found]
    if isinstance(found, float | int) and not isinstance(found, bool):
        return found * (factor if name.endswith("_mm") else factor**3 if name == "mass_g" else 1)
    return found
