"""One writer thread with group commit: many submissions share one transaction and one fsync."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import groupby
from queue import Empty, SimpleQueue
from typing import Any

from sqlalchemy import Connection, Engine
from sqlalchemy.exc import IntegrityError

from app.store.engine import BY_DRIVER
from app.store.errors import StoreClosed
from app.store.faults import FaultKind, StoreFault, fault_of, is_write_conflict

_MAX_ATTEMPTS = 3
"""Maximum attempts of a write that conflicts with another process."""
_TIMEOUT_KINDS = (FaultKind.BUSY, FaultKind.UNREACHABLE)

Operation = Callable[[Connection], Any]
"""A write: runs inside a transaction and returns the value that the submitter gets after the commit.

It may be re-run after a rollback, so it must have no other side effects. A class of operations may define
``together(connection, operations) -> list of results`` to run adjacent operations of a group in one call.
"""


@dataclass(eq=False)
class _Submission:
    operation: Operation
    loop: asyncio.AbstractEventLoop | None
    future: Any
    value: Any = None
    error: BaseException | None = None


class GroupWriter:
    """Runs write operations on one thread and commits all waiting ones together.

    A submission completes only after its commit is durable. An operation that fails is rolled back and reported alone;
    the others of its group are run again. At most ``capacity`` submissions of the event loop are queued; further ones
    wait.
    """

    def __init__(
        self,
        engine: Engine,
        capacity: int = 4096,
        group_limit: int = 256,
        check: Callable[[], None] = lambda: None,
        on_commit: Callable[[float, StoreFault | None], None] = lambda _seconds, _fault: None,
    ) -> None:
        """``check`` raises if writes would be lost; ``on_commit`` receives the duration of each group and its fault, if
        any."""
        self._engine, self._check, self._on_commit = engine, check, on_commit
        self._group_limit = group_limit
        self._waiting: SimpleQueue[_Submission | None] = SimpleQueue()
        self._closing = threading.Lock()
        self._closed = False
        self._connection: Connection | None = None
        self._slots = asyncio.Semaphore(capacity)
        self._thread = threading.Thread(target=self._run, name="store-writer", daemon=True)
        self._thread.start()

    async def submit(self, operation: Operation) -> Any:
        """Run the operation and wait for its commit. Cancelling the wait does not undo the write."""
        async with self._slots:
            loop = asyncio.get_running_loop()
            future: asyncio.Future[Any] = loop.create_future()
            self._enqueue(_Submission(operation, loop, future))
            return await future

    def submit_and_wait(self, operation: Operation) -> Any:
        """Blocking ``submit`` for code without an event loop."""
        future: Future[Any] = Future()
        self._enqueue(_Submission(operation, None, future))
        return future.result()

    def close(self) -> None:
        """Refuse new writes, commit the waiting ones, and stop the thread."""
        with self._closing:
            self._closed = True
            self._waiting.put(None)
        self._thread.join()

    def _enqueue(self, submission: _Submission) -> None:
        with self._closing:  # nothing follows the None that ends the thread
            if self._closed:
                raise StoreClosed("the store is closing")
            self._waiting.put(submission)

    def _run(self) -> None:
        last = False
        while not last:
            group, last = self._take()
            if group:
                self._commit(group)
            del group  # free what was written now, not at the next write
        if self._connection is not None:
            self._connection.close()

    def _take(self) -> tuple[list[_Submission], bool]:
        """Wait for submissions; Return those waiting, up to the limit, and whether they are the last."""
        group: list[_Submission] = []
        following = self._waiting.get()
        with suppress(Empty):
            while following is not None:
                group.append(following)
                if len(group) == self._group_limit:
                    return group, False
                following = self._waiting.get_nowait()
            return group, True
        return group, False

    def _commit(self, group: list[_Submission]) -> None:
        began = time.monotonic()
        self._write(group)
        fault = _classify_errors(group)
        if fault is not None and fault.kind in _TIMEOUT_KINDS:
            # The timeout has passed once already: fail the writes queued meanwhile instead of letting each wait as
            # long.
            group += self._fail_waiting(fault)
        self._on_commit(time.monotonic() - began, fault)
        _deliver(group)

    def _fail_waiting(self, fault: StoreFault) -> list[_Submission]:
        late = []
        for _ in range(self._waiting.qsize()):
            submission = self._waiting.get()
            if submission is None:
                self._waiting.put(None)  # it was the last
            else:
                submission.error = fault
                late.append(submission)
        return late

    def _write(self, group: list[_Submission]) -> None:
        if len(group) > 1 and self._write_together(group):
            return
        for submission in group:
            self._write_alone(submission)

    def _write_together(self, group: list[_Submission]) -> bool:
        """Run a group in one transaction; False if an operation failed and each must be run alone."""
        settled = True
        try:
            self._check()
            with self._transaction() as connection:
                try:
                    _operate(connection, group)
                except BaseException as error:
                    # A database fault concerns every operation of the group. After a write conflict, running them one
                    # by one resolves a deadlock between two groups.
                    settled = fault_of(error) is not None and not is_write_conflict(error)
                    raise
            self._check()
        except BaseException as error:
            # BEGIN or COMMIT failed: a database fault, which retries one by one would meet again.
            if settled:
                for submission in group:
                    submission.error = error
        return settled

    @contextmanager
    def _transaction(self) -> Iterator[Connection]:
        """A transaction of the writer.

        A connection to a file is kept, because taking one from the pool costs up to a sixth of a small write, and its
        driver begins and commits, because SQLAlchemy's own account of transactions costs another tenth. A connection to
        a server is taken from the pool, which tests it before every use.
        """
        if self._engine.dialect.name != "sqlite":
            with self._engine.begin() as connection:
                yield connection
            return
        connection = self._connection or self._engine.connect().execution_options(**BY_DRIVER)
        self._connection = None
        try:
            driver: Any = connection.connection.driver_connection
            driver.execute("BEGIN IMMEDIATE")
            yield connection
            driver.commit()
        except BaseException:
            connection.close()  # which rolls back
            raise
        self._connection = connection

    def _write_alone(self, submission: _Submission) -> None:
        for left in reversed(range(_MAX_ATTEMPTS)):
            submission.value, submission.error = None, None
            try:
                self._check()
                with self._transaction() as connection:
                    submission.value = submission.operation(connection)
                self._check()
                return
            except BaseException as error:
                submission.error = error
                # Another process may have committed the same key in between; the next attempt sees it.
                if not left or not (isinstance(error, IntegrityError) or is_write_conflict(error)):
                    return


def _operate(connection: Connection, group: list[_Submission]) -> None:
    """Run the operations of a group in order, adjacent ones of a class with ``together`` in one call."""
    for kind, neighbours in groupby(group, key=lambda submission: type(submission.operation)):
        submissions = list(neighbours)
        together = getattr(kind, "together", None)
        if together is not None:
            values = together(connection, [submission.operation for submission in submissions])
        else:
            values = [submission.operation(connection) for submission in submissions]
        for submission, value in zip(submissions, values, strict=True):
            submission.value = value


def _classify_errors(group: list[_Submission]) -> StoreFault | None:
    """Replace driver errors by faults; return the first fault, if any."""
    first = None
    for submission in group:
        fault = None if submission.error is None else fault_of(submission.error)
        if fault is not None:
            submission.error = fault
            first = first or fault
    return first


def _deliver(group: list[_Submission]) -> None:
    loops: dict[asyncio.AbstractEventLoop, list[_Submission]] = {}
    for submission in group:
        if submission.loop is None:
            _resolve(submission)
        else:
            loops.setdefault(submission.loop, []).append(submission)
    for loop, submissions in loops.items():
        # A closed loop has no one to notify; the rows are durable nevertheless.
        with suppress(RuntimeError):
            loop.call_soon_threadsafe(_resolve_all, submissions)


def _resolve_all(submissions: list[_Submission]) -> None:
    for submission in submissions:
        _resolve(submission)


def _resolve(submission: _Submission) -> None:
    if submission.future.done():
        return
    if submission.error is not None:
        submission.future.set_exception(submission.error)
    else:
        submission.future.set_result(submission.value)
