"""Request ids and the log of requests."""

from __future__ import annotations

import os
import re
import time

from app.edge.asgi import Application, Message, Receive, Scope, Send, header, refuse
from app.edge.concurrency import HEALTH_PATHS
from app.errors import Problem
from app.logging import get_logger, request_id

logger = get_logger(__name__)

HEADER = b"x-request-id"
_VALID_ID = re.compile(rb"[\w.:-]{1,64}")


class RequestLog:
    """Middleware that assigns each request an id, the client's or a new one, and logs its end and unexpected
    exceptions."""

    def __init__(self, app: Application) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        sent = header(scope, HEADER)
        given = sent if sent is not None and _VALID_ID.fullmatch(sent) else os.urandom(8).hex().encode()
        began, status, complete = time.perf_counter(), 0, False

        async def logged(message: Message) -> None:
            nonlocal status, complete
            if message["type"] == "http.response.start":
                status = message["status"]
                message["headers"] = [*message.get("headers", ()), (HEADER, given)]
            else:
                complete = not message.get("more_body", False)
            await send(message)

        token = request_id.set(given.decode())
        try:
            await self._app(scope, receive, logged)
        except Exception:
            logger.exception("request_failed", method=scope["method"], path=scope["path"])
            if not status:
                await refuse(scope, receive, logged, Problem(500, "Something went wrong", "the fault is here"))
            elif not complete:
                raise
        finally:
            client = scope["client"][0] if scope.get("client") else ""
            detail = {"method": scope["method"], "path": scope["path"], "status": status, "client": client}
            seconds = round(time.perf_counter() - began, 4)
            log = logger.debug if scope["path"] in HEALTH_PATHS else logger.warning if status >= 500 else logger.info
            log("request", **detail, seconds=seconds)
            request_id.reset(token)
