"""One writer thread with group commit: many submissions share one transaction and one fsync."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from sqlalchemy import Connection, Engine
from sqlalchemy.exc import IntegrityError

from app.store.engine import WRITE
from app.store.errors import StoreClosed
from app.store.faults import StoreFault, Trouble, collided, fault_of

_ATTEMPTS = 3
"""So often a write is tried that another process comes in the way of."""
_WAITED_FOR = (Trouble.BUSY, Trouble.UNREACHABLE)

Operation = Callable[[Connection], Any]
"""A write: runs inside a transaction, returns what the submitter gets after the commit.

It may be run again after a rollback, so it must change nothing but the database. A class of operations may
offer ``together(connection, operations) -> list of results`` for neighbours of its kind in one group.
"""


@dataclass(eq=False)
class _Ticket:
    operation: Operation
    loop: asyncio.AbstractEventLoop | None
    future: Any
    value: Any = None
    error: BaseException | None = None


class GroupWriter:
    """Runs write operations on one thread, committing all that wait together.

    A submitter hears back only after the commit that holds its rows is durable. An operation that fails is
    rolled back and reported alone: its neighbours are run again without it. At most ``capacity`` operations
    of the event loop wait at once; further submitters wait their turn.
    """

    def __init__(
        self,
        engine: Engine,
        capacity: int = 4096,
        group_limit: int = 256,
        check: Callable[[], None] = lambda: None,
        seen: Callable[[float, StoreFault | None], None] = lambda _seconds, _fault: None,
    ) -> None:
        """``check`` raises where writes would be lost; ``seen`` hears what each group took, and what was wrong."""
        self._engine, self._check, self._seen = engine, check, seen
        self._group_limit = group_limit
        self._waiting: deque[_Ticket] = deque()
        self._wake = threading.Condition()
        self._closed = False
        self._slots = asyncio.Semaphore(capacity)
        self._thread = threading.Thread(target=self._run, name="store-writer", daemon=True)
        self._thread.start()

    async def submit(self, operation: Operation) -> Any:
        """Run the operation and wait for its commit. Cancelling the wait does not take the write back."""
        async with self._slots:
            loop = asyncio.get_running_loop()
            future: asyncio.Future[Any] = loop.create_future()
            self._enqueue(_Ticket(operation, loop, future))
            return await future

    def submit_and_wait(self, operation: Operation) -> Any:
        """The same for code without an event loop."""
        future: Future[Any] = Future()
        self._enqueue(_Ticket(operation, None, future))
        return future.result()

    def close(self) -> None:
        """Take no more, commit everything that waits, end the thread."""
        with self._wake:
            self._closed = True
            self._wake.notify()
        self._thread.join()

    def _enqueue(self, ticket: _Ticket) -> None:
        with self._wake:
            if self._closed:
                raise StoreClosed("the store is closing")
            self._waiting.append(ticket)
            self._wake.notify()

    def _run(self) -> None:
        while True:
            with self._wake:
                while not self._waiting and not self._closed:
                    self._wake.wait()
                if not self._waiting:
                    return
                count = min(len(self._waiting), self._group_limit)
                group = [self._waiting.popleft() for _ in range(count)]
            began = time.monotonic()
            self._write(group)
            fault = _told_as_faults(group)
            if fault is not None and fault.trouble in _WAITED_FOR:
                # It was waited for long enough: whoever came meanwhile would only wait as long for the same.
                group += self._give_up(fault)
            self._seen(time.monotonic() - began, fault)
            _deliver(group)

    def _give_up(self, fault: StoreFault) -> list[_Ticket]:
        with self._wake:
            late = list(self._waiting)
            self._waiting.clear()
        for ticket in late:
            ticket.error = fault
        return late

    def _write(self, group: list[_Ticket]) -> None:
        if len(group) > 1 and self._write_together(group):
            return
        for ticket in group:
            self._write_alone(ticket)

    def _write_together(self, group: list[_Ticket]) -> bool:
        """True if the group's fate is settled; False if one operation failed and each must stand alone."""
        settled = True
        try:
            self._check()
            with self._engine.connect().execution_options(**WRITE) as connection, connection.begin():
                try:
                    _operate(connection, group)
                except BaseException as error:
                    # What is wrong with the database is wrong for each of them; two groups that each hold what the
                    # other wants come through one by one.
                    settled = fault_of(error) is not None and not collided(error)
                    raise
            self._check()
        except BaseException as error:
            # BEGIN or COMMIT failed: the database itself is in trouble, and trying one by one would only
            # make every submitter wait for the same answer.
            if settled:
                for ticket in group:
                    ticket.error = error
        return settled

    def _write_alone(self, ticket: _Ticket) -> None:
        for left in reversed(range(_ATTEMPTS)):
            ticket.value, ticket.error = None, None
            try:
                self._check()
                with self._engine.connect().execution_options(**WRITE) as connection, connection.begin():
                    ticket.value = ticket.operation(connection)
                self._check()
                return
            except BaseException as error:
                ticket.error = error
                # Another process may have committed the same key in between: the next attempt sees it.
                if not left or not (isinstance(error, IntegrityError) or collided(error)):
                    return


def _operate(connection: Connection, group: list[_Ticket]) -> None:
    """Run every operation of the group in order, neighbours of one kind together where their kind can."""
    for kind, neighbours in groupby(group, key=lambda ticket: type(ticket.operation)):
        tickets = list(neighbours)
        together = getattr(kind, "together", None)
        if together is not None:
            values = together(connection, [ticket.operation for ticket in tickets])
        else:
            values = [ticket.operation(connection) for ticket in tickets]
        for ticket, value in zip(tickets, values, strict=True):
            ticket.value = value


def _told_as_faults(group: list[_Ticket]) -> StoreFault | None:
    """Tell what drivers raised as faults; the first one, None if there is none."""
    first = None
    for ticket in group:
        fault = None if ticket.error is None else fault_of(ticket.error)
        if fault is not None:
            ticket.error = fault
            first = first or fault
    return first


def _deliver(group: list[_Ticket]) -> None:
    loops: dict[asyncio.AbstractEventLoop, list[_Ticket]] = {}
    for ticket in group:
        if ticket.loop is None:
            _resolve(ticket)
        else:
            loops.setdefault(ticket.loop, []).append(ticket)
    for loop, tickets in loops.items():
        # A loop that ended has nobody left to tell; the rows are durable all the same.
        with suppress(RuntimeError):
            loop.call_soon_threadsafe(_resolve_all, tickets)


def _resolve_all(tickets: list[_Ticket]) -> None:
    for ticket in tickets:
        _resolve(ticket)


def _resolve(ticket: _Ticket) -> None:
    if ticket.future.done():
        return
    if ticket.error is not None:
        ticket.future.set_exception(ticket.error)
    else:
        ticket.future.set_result(ticket.value)
