"""POST /api/v1/designs, /checks: one route per kind and mode, made from the registry."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Header, Request, Response

from app.api.bodies import parse, read_body
from app.designs.kind import Kind, Mode
from app.designs.registry import KINDS
from app.errors import Problem
from app.store.hashing import request_hash
from app.store.record import StoredResponse
from app.submission import Service

router = APIRouter(prefix="/api/v1")

PATHS = {Mode.DESIGN: "designs", Mode.CHECK: "checks", Mode.ANALYSIS: "analyses"}
_MOST_KEY = 200


def answer(response: StoredResponse) -> Response:
    """A stored answer as an HTTP response."""
    headers = {"Location": response.location} if response.location else {}
    return Response(response.body, response.status_code, headers, response.content_type)


def _route(kind: Kind, mode: Mode) -> None:
    job = kind.jobs[mode]

    async def submit(
        request: Request,
        idempotency_key: Annotated[str | None, Header(max_length=_MOST_KEY)] = None,
        prefer: Annotated[str | None, Header()] = None,
    ) -> Response:
        service: Service = request.app.state.service
        body = await read_body(request)
        digest = request_hash("POST", request.url.path, body)
        if idempotency_key:
            first = await service.store.find_response(idempotency_key, digest)
            if first is not None:
                return answer(first)
        asked = parse(job.request, body)
        later = mode is Mode.DESIGN and "respond-async" in (prefer or "")
        handle = service.submit_later if later else service.submit
        return answer(await handle(kind, mode, asked, idempotency_key, digest))

    router.add_api_route(
        f"/{PATHS[mode]}/{kind.slug}",
        submit,
        methods=["POST"],
        status_code=201,
        summary=f"{mode.value.capitalize()} · {kind.title}",
        description=(job.request.__doc__ or ""),
        name=f"{mode}-{kind.slug}",
        tags=[kind.slug],
        responses={
            409: {"description": "the idempotency key was used with another request"},
            413: {"description": "the body is too large"},
            415: {"description": "the body is not JSON"},
            422: {"description": "problem details with one entry per bad field"},
            503: {"description": "too much work waits"},
        },
        openapi_extra={
            "requestBody": {
                "required": True,
                "content": {
                    "application/json": {
                        "schema": job.request.model_json_schema(ref_template="#/components/schemas/{model}"),
                        "example": kind.example(mode),
                    }
                },
            }
        },
    )


for _kind in KINDS.values():
    for _mode in _kind.jobs:
        _route(_kind, _mode)


@router.post("/{collection}/{slug}", include_in_schema=False)
async def unknown_kind(collection: str, slug: str) -> Response:
    """Name what there is when a kind or a mode does not exist."""
    known = sorted(f"{PATHS[mode]}/{kind.slug}" for kind in KINDS.values() for mode in kind.jobs)
    raise Problem(404, "No such kind", "there are " + ", ".join(known))
