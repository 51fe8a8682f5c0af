"""Cancellation of work whose client has disconnected."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any, TypeVar

T = TypeVar("T")
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]


class ClientDisconnected(Exception):
    """The client disconnected before its response was ready."""


_WATCHED_AFTER_S = 0.02
"""Time after which a disconnect is watched for: the watch costs a task, which short work does not need."""


async def cancel_on_disconnect(receive: Receive, work: Awaitable[T]) -> T:
    """Wait for ``work`` and return its result; cancel it and raise ClientDisconnected if the client disconnects.

    ``receive`` is the request's own, with the body already read.
    """
    own, gone, working = asyncio.current_task(), None, True

    def left(_: asyncio.Task[None]) -> None:
        if working and own is not None:
            own.cancel()

    def watch() -> None:
        nonlocal gone
        gone = asyncio.create_task(_disconnected(receive))
        gone.add_done_callback(left)

    timer = asyncio.get_running_loop().call_later(_WATCHED_AFTER_S, watch)
    try:
        return await work
    except asyncio.CancelledError:
        if gone is None or not gone.done() or gone.cancelled():
            raise
        if own is not None:
            own.uncancel()
        raise ClientDisconnected from gone.exception()
    finally:
        working = False
        timer.cancel()
        if gone is not None:
            gone.cancel()


async def _disconnected(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
