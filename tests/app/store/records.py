"""Records for store tests."""

from __future__ import annotations

import json
from dataclasses import replace

from app.store.hashing import spec_hash
from app.store.record import RunRecord, StoredResponse, new_run_id, utc_now


def make_record(x: float = 1.0, **changes: object) -> RunRecord:
    spec = json.dumps({"name": "ein Stück", "crank_radius_mm": x}).encode()
    record = RunRecord(
        id=new_run_id(),
        kind="flexible-rod",
        mode="check",
        status="succeeded",
        name="ein Stück",
        created_at=utc_now(),
        spec=spec,
        spec_hash=spec_hash("flexible-rod", "check", spec),
        result=b'{"fatigue_safety": 2.70}',
        problem=None,
        effects=b'[{"name":"shear","state":"skipped"}]',
        accuracy=b'{"requested":1e-06}',
        timing=b'{"solve_s":0.00002}',
        solver_name="crankwright",
        solver_version="0.1.0",
        verdict=b'{"holds":true}',
        holds=True,
        figure_name="fatigue_safety",
        figure=2.7,
    )
    return replace(record, **changes)  # type: ignore[arg-type]


def make_response(record: RunRecord, key: str = "key-1", request_hash: str = "a" * 64) -> StoredResponse:
    body = b'{"id":"' + record.id.encode() + b'"}'
    return StoredResponse(key, request_hash, record.id, 201, f"/api/v1/runs/{record.id}", "application/json", body)
