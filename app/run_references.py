"""Resolution of references to stored runs in requests."""

from __future__ import annotations

import json

from pydantic import BaseModel

from app import runs
from app.designs.problems import INVALID
from app.designs.references import UnfitRun, references, replaced
from app.designs.refusals import json_pointer
from app.designs.schema import entry
from app.errors import Problem
from app.store.errors import UnknownRun
from app.store.repository import RunStore


async def resolve_references(store: RunStore, request: BaseModel) -> BaseModel:
    """The request with every referenced run filled in. Raises Problem if a run is missing or unsuitable."""
    for path, reference in list(references(request)):
        at = json_pointer((*path, "run_id"))
        try:
            run = json.loads(runs.run_json(await store.get(reference.run_id)))
            request = replaced(request, path, reference.filled(run))
        except UnknownRun:
            found = entry(at, "no run has this id", "the id of a stored run")
        except UnfitRun as unfit:
            found = entry(at, unfit.reason, unfit.allowed)
        else:
            continue
        raise Problem(422, INVALID, found["detail"], [found])
    return request
