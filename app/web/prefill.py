"""What a form starts with: the kind's example, or what a stored run was asked, with a load taken from another run.

``?from=ID`` takes the spec of a run; ``?load_run=ID&instant=NAME`` puts a worst instant of a crank-dynamics run, or
without one its whole cycle, in the place of the load.
"""

from __future__ import annotations

import json
from typing import Any

from fastapi import Request

from app.designs.kind import Kind, Mode
from app.errors import Problem
from app.submission import Service


async def prefilled(request: Request, kind: Kind, mode: Mode) -> dict[str, Any]:
    """A spec of that kind and mode. Raises Problem for a run of another one, UnknownRun for none."""
    query = request.query_params
    spec = kind.example(mode)
    if "from" in query:
        service: Service = request.app.state.service
        run = await service.store.get(query["from"])
        if (run.kind, run.mode) != (kind.slug, str(mode)):
            raise Problem(409, "Another form", f"the run is of {run.kind}, {run.mode}")
        # What the form shows first comes first, as in the example; what only the run has follows.
        asked = json.loads(run.spec)
        spec = {name: asked[name] for name in [*spec, *asked] if name in asked}
    if "load_run" in query:
        spec["load"] = {"kind": "run", "run_id": query["load_run"]}
        if query.get("instant"):
            spec["load"]["instant"] = query["instant"]
        spec["name"] = ""
    return spec
