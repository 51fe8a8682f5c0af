"""/api/v1/batches: many requests as one job."""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Header, Query, Request, Response
from fastapi.responses import StreamingResponse

from app.api.bodies import parse_in_turn, read_body
from app.api.queries import check_kind, check_query_names
from app.batches.columns import OWN_TYPES, column
from app.batches.fields import names as field_names
from app.batches.fields import result_columns
from app.batches.results import MEDIA_TYPES, Format, Wanted
from app.batches.service import Asked, BatchService
from app.batches.sweep import Sweep
from app.batches.view import batch_json
from app.designs.kind import Detail, Mode
from app.designs.problems import INVALID
from app.designs.refusals import MAX_ENTRIES, with_suggestion
from app.designs.registry import KINDS, job_of
from app.designs.schema import entry
from app.errors import Problem, refusing_if_disk_is_full
from app.store.batch_reads import BatchFilter
from app.store.batch_records import BatchRecord, BatchStatus, ItemStatus
from app.store.hashing import canonical_json

router = APIRouter(prefix="/api/v1/batches", tags=["batches"], dependencies=[Depends(check_query_names)])

_MAX_KEY_LENGTH = 200
_LINES = {"application/x-ndjson": False, "application/jsonl": False, "text/csv": True}
_PARQUET = "application/vnd.apache.parquet"
_ACCEPTED = "application/json (a sweep), application/x-ndjson, text/csv or " + _PARQUET
_MISSING: dict[int | str, dict[str, str]] = {404: {"description": "there is no such batch"}}
_REFUSALS: dict[int | str, dict[str, str]] = {
    400: {"description": "the body cannot be read"},
    409: {"description": "the idempotency key was used with another request"},
    413: {"description": "the batch is too large"},
    415: {"description": "unsupported media type"},
    429: {"description": "too many of the caller's batches have not ended; see Retry-After"},
    422: {"description": "no such kind or mode, columns that are not fields, a contradictory sweep"},
    501: {"description": "Parquet support is not installed"},
    503: {"description": "the database is locked by another process"},
    507: {"description": "the disk is full; nothing was stored"},
}


def _service(request: Request) -> BatchService:
    return request.app.state.batches


def _answer(shown: bytes) -> Response:
    location = json.loads(shown)["links"]["self"]
    return Response(shown, 202, {"Location": location, "Retry-After": "1"}, "application/json")


@router.post("", status_code=202, summary="Submit a batch", responses=_REFUSALS)
async def submit_batch(
    request: Request,
    kind: Annotated[str, Query(max_length=64, description="kind and mode of every row; a sweep names its own")] = "",
    mode: Annotated[str, Query(max_length=16, description="kind and mode of every row; a sweep names its own")] = "",
    name: Annotated[
        str, Query(max_length=200, pattern=r"^[^\x00]*$", description="name of the batch, unless a sweep has its own")
    ] = "",
    detail: Annotated[
        Detail,
        Query(
            description="detail of the stored results: without curves and tables, or full; unless a sweep has its own"
        ),
    ] = Detail.SCALARS,
    idempotency_key: Annotated[str | None, Header(max_length=_MAX_KEY_LENGTH)] = None,
) -> Response:
    """Rows as NDJSON, CSV or Parquet with kind and mode in the query, or a sweep as JSON. Responds once every item is
    durably stored. An invalid row becomes a refused item and does not affect the others. A CSV may also be separated by
    semicolons or tabs; its numbers may then have decimal commas."""
    service = _service(request)
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    digest = hashlib.sha256(media_type.encode() + b"\n")
    if media_type == "application/json":
        body = await read_body(request)
        digest.update(body)
        if name or detail is not Detail.SCALARS:
            digest.update(canonical_json([name, detail]))

        async def take() -> bytes:
            sweep = await parse_in_turn(request, Sweep, body)
            asked = {"name": name, "detail": detail}
            more = {field: value for field, value in asked.items() if field not in sweep.model_fields_set}
            return await service.take_sweep(sweep.model_copy(update=more), idempotency_key, digest)

        return await _once(service, idempotency_key, digest, take)
    if media_type not in _LINES and media_type != _PARQUET:
        raise Problem(415, "No batch", f"send {_ACCEPTED}")
    asked = Asked.of(kind, mode, name, detail)
    stream = request.stream()
    if media_type in _LINES:
        return _answer(await service.take_lines(asked, _LINES[media_type], stream, idempotency_key, digest))
    with refusing_if_disk_is_full(), tempfile.TemporaryDirectory(prefix="crankwright-") as folder:
        file = Path(folder) / "batch.parquet"
        with file.open("wb") as sink:
            async for part in stream:
                digest.update(part)
                sink.write(part)
        return _answer(await service.take_parquet(asked, file, idempotency_key, digest))


async def _once(service: BatchService, key: str | None, digest: Any, take: Any) -> Response:
    """Replay the response stored under the key, or take the batch in."""
    if key:
        first = await service.first_answer(key, digest.hexdigest())
        if first is not None:
            return _answer(first)
    return _answer(await take())


@router.get("", summary="List batches")
async def list_batches(
    request: Request,
    kind: str | None = None,
    mode: Mode | None = None,
    status: Literal["queued", "running", "ended", "cancelled"] | None = None,
    name: Annotated[str | None, Query(max_length=200, description="the exact name")] = None,
    cursor: Annotated[str | None, Query(max_length=36)] = None,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
) -> dict[str, Any]:
    """Batches matching all filters, newest first; ``next_cursor`` requests the next page."""
    check_kind(kind)
    found, cursor = await _service(request).list(
        BatchFilter(kind, mode, status and BatchStatus(status), name), cursor, limit
    )
    return {"items": [batch_json(batch) for batch in found], "next_cursor": cursor}


@router.get("/{batch_id}", summary="One batch", responses=_MISSING)
async def one_batch(request: Request, batch_id: str) -> dict[str, Any]:
    """The batch with its counters."""
    return batch_json(await _service(request).get(batch_id))


@router.delete(
    "/{batch_id}", summary="Cancel a batch", responses={**_MISSING, 409: {"description": "the batch has ended"}}
)
async def cancel_batch(request: Request, batch_id: str) -> dict[str, Any]:
    """Stop solving. Finished items are kept."""
    return batch_json(await _service(request).cancel(batch_id))


def _wanted(batch: BatchRecord, status: str | None, fields: str | None) -> Wanted:
    statuses, names = _listed(status), _listed(fields)
    known = [str(each) for each in ItemStatus]
    found = [
        entry("/status", with_suggestion(f"has {each[:100]}, which is no status", each, known), ", ".join(known))
        for each in statuses
        if each not in known
    ]
    known = (*OWN_TYPES, *result_columns(batch.kind, batch.mode), *field_names(batch.kind, batch.mode))
    allowed = "dotted names of the request and the result, and " + ", ".join(OWN_TYPES)
    left_out = () if batch.detail == Detail.FULL else job_of(KINDS[batch.kind], Mode(batch.mode)).tables
    for each in names:
        chosen = column(batch.kind, batch.mode, each)
        if chosen is None:
            said = with_suggestion(f"has {each[:100]}, which is no column", each, known)
            found.append(entry("/fields", said, allowed))
        elif chosen.part == "result" and chosen.path.partition(".")[0] in left_out:
            said = f"has {each[:100]}, which is stored only with detail=full"
            found.append(entry("/fields", said, "scalars of the result, or a batch submitted with detail=full"))
    if found:
        raise Problem(422, INVALID, "the table cannot be made", found[:MAX_ENTRIES])
    return Wanted(statuses, names)


def _listed(value: str | None) -> tuple[str, ...]:
    return tuple(dict.fromkeys(filter(None, (value or "").split(","))))


@router.get("/{batch_id}/results", summary="The results as a table", responses=_MISSING, response_class=Response)
async def batch_results(
    request: Request,
    batch_id: str,
    format: Format = Format.NDJSON,
    status: Annotated[
        str | None, Query(max_length=100, description="status of the items; several separated by commas")
    ] = None,
    fields: Annotated[
        str | None,
        Query(
            max_length=8000,
            description="dotted names of the columns, separated by commas; objects and arrays are JSON text; default: "
            "what every item has, the fields in which the requests differ, and all scalars of the result",
        ),
    ] = None,
) -> Response:
    """Results of the items finished so far, in order, as a stream. A field that the request and the result have both
    is the result's by its name, and the request's as ``spec.`` and its name: ``spec.impact_speed_m_s`` was asked for,
    ``impact_speed_m_s`` is reached."""
    service = _service(request)
    batch = await service.get(batch_id)
    wanted = _wanted(batch, status, fields)
    if format is Format.PARQUET:
        _needs_parquet()
    name = f"{batch.kind}-{batch.mode}-{batch.id}.{format}"
    return StreamingResponse(
        service.results(batch, wanted, format),
        media_type=MEDIA_TYPES[format],
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


def _needs_parquet() -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise Problem(501, "No Parquet here", "this service was installed without the extra [parquet]") from None


@router.get("/{batch_id}/events", summary="Progress as server-sent events", responses=_MISSING, response_class=Response)
async def batch_events(request: Request, batch_id: str) -> Response:
    """``progress`` events with the batch whenever it changes, at most twice a second; the last event is ``ended``."""
    service = _service(request)
    await service.get(batch_id)

    async def events() -> AsyncIterator[bytes]:
        async for batch in service.progress(batch_id, request.app.state.service.stopping.is_set):
            yield _event(batch)

    return StreamingResponse(events(), media_type="text/event-stream", headers={"Cache-Control": "no-store"})


def _event(batch: BatchRecord) -> bytes:
    over = batch.status in (BatchStatus.ENDED, BatchStatus.CANCELLED)
    shown = json.dumps(batch_json(batch), separators=(",", ":"))
    return f"event: {'ended' if over else 'progress'}\ndata: {shown}\n\n".encode()
