"""Runs in the service's JSON form, made without a service."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from app.designs.kind import Mode
from app.designs.registry import KINDS, job_of


def solved(slug: str, mode: Mode, spec: dict[str, Any]) -> dict[str, Any]:
    """Solve a request and return its run."""
    kind = KINDS[slug]
    job = job_of(kind, mode)
    request = job.request.model_validate(spec)
    answer = job.solve(request)
    result = None if answer.result is None else json.loads(json.dumps(answer.result))
    name, value = kind.headline(mode, result) if answer.status == "succeeded" else ("", None)
    return {
        "id": "0190c0de-0000-7000-8000-000000000001",
        "kind": slug,
        "mode": str(mode),
        "status": answer.status,
        "name": json.loads(request.model_dump_json()).get("name", ""),
        "created_at": "2026-01-31T12:00:00.123456+00:00",
        "spec": json.loads(request.model_dump_json()),
        "spec_hash": "0123456789abcdef" * 4,
        "cached": False,
        "batch_id": None,
        "holds": (answer.verdict or {}).get("holds"),
        "figure": None if value is None else {"name": name, "value": value},
        "solver": {"name": "crankwright", "version": "0"},
        "verdict": answer.verdict,
        "result": result,
        "problem": answer.problem,
        "effects": answer.effects,
        "accuracy": answer.accuracy,
        "timing": answer.timing,
        "progress": None,
    }


@cache
def _example(slug: str, mode: Mode, title: str) -> str:
    kind = KINDS[slug]
    spec = kind.others(mode)[title] if title else kind.example(mode)
    return json.dumps(solved(slug, mode, spec))


def example(slug: str, mode: Mode, title: str = "") -> dict[str, Any]:
    """The run of one of the kind's examples, cached."""
    return json.loads(_example(slug, mode, title))


_SLOW = ("flexible-rod", Mode.DESIGN)
"""Omitted: takes seconds of search, and the variant from stock covers the same."""
EXAMPLES = [(kind.slug, mode, "") for kind in KINDS.values() for mode in kind.jobs if (kind.slug, mode) != _SLOW]
OTHERS = [(kind.slug, mode, title) for kind in KINDS.values() for mode in kind.jobs for title in kind.others(mode)]
