"""POST /api/v1/designs, /checks, /accuracy, …: one route per kind and mode, generated from the registry."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import APIRouter, FastAPI, Header, Request, Response
from fastapi.routing import APIRoute

from app.access.csrf import check_csrf
from app.api.bodies import parse_in_turn, read_body
from app.api.contract import PATHS
from app.designs.kind import Kind, Mode
from app.designs.problems import INVALID
from app.designs.registry import KINDS, job_of, modes_of
from app.designs.schema import entry
from app.edge.asgi import Application, Receive, Scope, Send, header
from app.edge.disconnect import cancel_on_disconnect
from app.errors import Problem
from app.store.hashing import request_hash
from app.store.record import StoredResponse
from app.submission import Service

router = APIRouter(prefix="/api/v1")
"""Fallback for paths that match no route of a solve."""

_MAX_KEY_LENGTH = 200
_ANSWERS: dict[int | str, dict[str, str]] = {
    201: {"description": "the run, answered and stored; an infeasible design is an answer, too"},
    202: {"description": "the queued run, requested by respond-async"},
    400: {"description": "the request cannot be read"},
    409: {"description": "the idempotency key was used with another request"},
    413: {"description": "the body is too large"},
    415: {"description": "the body is not JSON"},
    422: {"description": "one entry per invalid field"},
    429: {"description": "the caller's quota is used up; see Retry-After"},
    503: {"description": "the queue is full; see Retry-After"},
}


async def _send(response: StoredResponse, send: Send) -> None:
    """Send a stored response; Starlette's class for responses takes as many steps again."""
    headers = [(b"location", response.location.encode())] if response.location else []
    if response.status_code == 202:
        headers.append((b"retry-after", b"1"))
    headers.append((b"content-length", b"%d" % len(response.body)))
    headers.append((b"content-type", response.content_type.encode()))
    await send({"type": "http.response.start", "status": response.status_code, "headers": headers})
    await send({"type": "http.response.body", "body": response.body})


class Solves:
    """Middleware that answers the routes of solves itself; all else passes on to FastAPI.

    FastAPI documents these routes. Its layers for errors, bodies and files and its router take a twentieth of the event
    loop's time of a small request, its resolution of parameters a tenth.
    """

    def __init__(self, inner: Application, routes: Mapping[str, APIRoute], handlers: Mapping[Any, Any]) -> None:
        """``routes`` by path, as ``install`` returns them; ``handlers`` of errors by class."""
        self._inner, self._routes, self._handlers = inner, routes, handlers

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        route = None
        if scope["type"] == "http" and scope["method"] == "POST":
            route = self._routes.get(scope["path"].removeprefix(scope.get("root_path", "")))
        if route is None:
            await self._inner(scope, receive, send)
            return
        scope["route"] = route
        request = Request(scope, receive, send)  # type: ignore[arg-type]
        try:
            response = await _answer(request, route)
        except Exception as error:
            found = next((each for each in type(error).__mro__ if each in self._handlers), Exception)
            if found is Exception:  # unforeseen: logged and answered at the edge
                raise
            await (await self._handlers[found](request, error))(scope, receive, send)
        else:
            await _send(response, send)


async def _answer(request: Request, route: APIRoute) -> StoredResponse:
    await check_csrf(request)
    key, prefer = header(request.scope, b"idempotency-key"), _joined(request.scope, b"prefer")
    if key is not None and len(key) > _MAX_KEY_LENGTH:
        found = entry("/idempotency-key", "has too many characters", f"at most {_MAX_KEY_LENGTH} long")
        raise Problem(422, INVALID, "1 field cannot be accepted", [found])
    given = [None if value is None else value.decode("latin-1") for value in (key, prefer)]
    return await route.endpoint(request, *given)


def _joined(scope: Scope, name: bytes) -> bytes:
    """The values of a header that is a list, which may be repeated."""
    return b",".join(value for key, value in scope["headers"] if key == name)


def _prefers_async(prefer: str) -> bool:
    """Whether the preferences (RFC 7240: a list of names, in upper or lower case, with parameters) ask for a 202."""
    return any(each.partition(";")[0].strip().lower() == "respond-async" for each in prefer.split(","))


def _route(app: FastAPI, kind: Kind, mode: Mode) -> None:
    job, path = job_of(kind, mode), f"/api/v1/{PATHS[mode]}/{kind.slug}"

    async def submit(
        request: Request,
        idempotency_key: Annotated[str | None, Header(max_length=_MAX_KEY_LENGTH)] = None,
        prefer: Annotated[str | None, Header()] = None,
    ) -> StoredResponse:
        service: Service = request.app.state.service
        body = await read_body(request)
        digest = ""
        if idempotency_key:
            digest = request_hash("POST", path, body)
            first = await service.store.find_response(idempotency_key, digest)
            if first is not None:
                return first
        asked = await parse_in_turn(request, job.request, body)
        if _prefers_async(prefer or ""):
            return await service.submit_later(kind, mode, asked, idempotency_key, digest)
        work = service.submit(kind, mode, asked, idempotency_key, digest)
        return await cancel_on_disconnect(request.receive, work)

    app.router.add_api_route(
        path,
        submit,
        methods=["POST"],
        status_code=201,
        summary=f"{mode.value.capitalize()} · {kind.title}",
        description=(job.request.__doc__ or ""),
        name=f"{mode}-{kind.slug}",
        tags=[kind.slug],
        responses=_ANSWERS,
        response_model=None,
    )


async def unknown_kind(slug: str) -> Response:
    """Respond 404 with the existing kinds and modes."""
    known = sorted(f"{PATHS[mode]}/{kind.slug}" for kind in KINDS.values() for mode in modes_of(kind))
    raise Problem(404, "No such kind", "there are " + ", ".join(known))


for _collection in PATHS.values():
    router.post(f"/{_collection}/{{slug}}", include_in_schema=False)(unknown_kind)


def install(app: FastAPI) -> dict[str, APIRoute]:
    """Add the routes to the application; those of solves by path, for ``Solves``."""
    before = len(app.router.routes)
    for kind in KINDS.values():
        for mode in modes_of(kind):
            _route(app, kind, mode)
    routes = [route for route in app.router.routes[before:] if isinstance(route, APIRoute)]
    app.include_router(router)
    return {route.path: route for route in routes}
