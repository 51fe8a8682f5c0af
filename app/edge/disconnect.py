"""Cancellation of work whose client has disconnected."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any, TypeVar

T = TypeVar("T")
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]


class ClientDisconnected(Exception):
    """The client disconnected before its response was ready."""


async def cancel_on_disconnect(receive: Receive, work: Awaitable[T]) -> T:
    """Wait for ``work`` and return its result; cancel it and raise ClientDisconnected if the client disconnects.

    ``receive`` is the request's own, with the body already read.
    """
    own, gone, working = asyncio.current_task(), asyncio.create_task(_disconnected(receive)), True

    def left(_: asyncio.Task[None]) -> None:
        if working and own is not None:
            own.cancel()

    gone.add_done_callback(left)
    try:
        return await work
    except asyncio.CancelledError:
        if not gone.done() or gone.cancelled():
            raise
        if own is not None:
            own.uncancel()
        raise ClientDisconnected from gone.exception()
    finally:
        working = False
        gone.cancel()


async def _disconnected(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
