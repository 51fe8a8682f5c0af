"""A worker process as the service sees it: started, asked, killed, reaped."""

from __future__ import annotations

import asyncio
import os
import pickle
import socket
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Self

from app.designs.progress import Report, ignore_progress
from app.jobs.errors import BudgetExceeded, MemoryExceeded, SolveFailed, WorkerCrashed
from app.jobs.fork_server import START_TIMEOUT_S, Child, ForkServer
from app.jobs.worker import LENGTH, Reply, WorkerSettings, serve

LOAD_TIMEOUT_S = 120.0
"""Time limit for loading or compiling what a call needs; not counted in the call's own budget."""
_READ_BYTES = 1 << 18
_LARGE_BYTES = 1 << 18
"""Size of a message that is decoded in a thread, where it does not hold up other requests."""


@dataclass(frozen=True)
class Call:
    """A solve: what to run, for how long, and where its progress goes."""

    kind_slug: str
    mode: str
    payload: bytes
    budget_s: float
    report: Report = ignore_progress


class Worker:
    """A live worker process and its pipe, which the event loop reads and writes itself.

    A thread in between would be woken twice for every request. The loop watches the pipe as long as the worker lives,
    because adding and removing a watch for every message costs ten system calls.
    """

    def __init__(self, child: Child, reap: Callable[[Child], int | None]) -> None:
        self._child, self._reap = child, reap
        self._socket = socket.socket(fileno=os.dup(child.connection.fileno()))
        self._socket.setblocking(False)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._received, self._closed = bytearray(), False
        self._arrived: asyncio.Future[None] | None = None
        self._loaded: set[tuple[str, str]] = set()
        self.usable = True
        """Whether it is ready for a call: false during a call, and permanently if a call ended without a reply."""
        self.outdated = False
        """Whether the fork server has loaded more since it was forked."""
        self.accepted = False
        """Whether it has acknowledged its latest call; otherwise it may have died before the call began."""
        self.exit_code: Future[int | None] = Future()
        """Set when the process was reaped; None if the fork server has died or restarted meanwhile."""

    @classmethod
    def start(cls, fork_server: ForkServer, settings: WorkerSettings) -> Self:
        """Fork a worker and wait until it is ready. Blocks. Raises WorkerCrashed, and OSError if the system is out of
        descriptors, processes or memory."""
        child = fork_server.fork(serve, settings, wait_s=0.0)
        try:
            if not child.connection.poll(START_TIMEOUT_S):
                raise EOFError
            child.connection.recv()
        except (EOFError, OSError) as error:
            child.kill()
            raise WorkerCrashed(fork_server.exit_code(child)) from error
        return cls(child, fork_server.exit_code)

    @property
    def pid(self) -> int:
        return self._child.pid

    @property
    def alive(self) -> bool:
        return self._child.alive

    def kill(self) -> None:
        self._child.kill()

    def reap(self) -> None:
        """Kill the process, free its resources, and set its exit code. Blocks until the fork server has answered."""
        self.kill()
        try:
            if self._loop is None:
                self._socket.close()
            else:  # only the loop may end its own watch, and the descriptor must stay until then
                self._loop.call_soon_threadsafe(self._close)
        except RuntimeError:  # the loop is closed
            self._socket.close()
        self.exit_code.set_result(self._reap(self._child))

    async def solve(self, call: Call) -> Any:
        """Run a call and return its answer.

        Raises BudgetExceeded, MemoryExceeded and SolveFailed; EOFError or OSError if the process has died;
        WorkerCrashed if it does not take the call. A worker that has not replied is no longer usable.
        """
        self.usable = self.accepted = False
        self._watch()
        clock = asyncio.get_running_loop().time
        kind, content = (call.kind_slug, call.mode), None
        await self._send((*kind, call.payload))
        if kind not in self._loaded:
            try:
                await self._receive(clock() + LOAD_TIMEOUT_S)
            except TimeoutError:
                raise WorkerCrashed(None) from None
            self._loaded.add(kind)
            self.accepted = True
        reply, deadline = str(Reply.PROGRESS), clock() + call.budget_s
        try:
            while reply == Reply.PROGRESS:
                reply, content = await self._receive(deadline)
                self.accepted = True
                if reply == Reply.PROGRESS:
                    call.report(content)
        except TimeoutError:
            raise BudgetExceeded(call.budget_s) from None
        if reply == Reply.MEMORY:
            raise MemoryExceeded("the solve exceeded the memory limit of a worker")
        self.usable = True
        if reply == Reply.ERROR:
            raise SolveFailed(*content)
        return content

    async def _send(self, message: tuple[str, str, bytes]) -> None:
        content = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
        data = LENGTH.pack(len(content)) + content
        try:
            sent = self._socket.send(data)
        except BlockingIOError:
            sent = 0
        if sent < len(data):
            async with asyncio.timeout(LOAD_TIMEOUT_S):
                await asyncio.get_running_loop().sock_sendall(self._socket, data[sent:])

    async def _receive(self, deadline: float) -> tuple[str, Any]:
        """The next message. Raises EOFError, and TimeoutError at the deadline [s] of the loop's clock."""
        loop, late = asyncio.get_running_loop(), False
        while (data := self._message()) is None:
            if self._closed:
                raise EOFError
            if late:  # a message that has arrived counts, even if the loop was late to read it
                if not self._read():
                    raise TimeoutError
                continue
            self._arrived = loop.create_future()
            timer = loop.call_at(deadline, _wake, self._arrived)
            try:
                await self._arrived
            finally:
                self._arrived = None
                timer.cancel()
            late = loop.time() >= deadline
        return await asyncio.to_thread(pickle.loads, data) if len(data) > _LARGE_BYTES else pickle.loads(data)

    def _watch(self) -> None:
        """Make the running loop read the pipe."""
        loop = asyncio.get_running_loop()
        if self._loop is not loop:
            loop.add_reader(self._socket, self._read)
            self._loop = loop

    def _close(self) -> None:
        """Stop the loop's watch, and close the pipe."""
        if self._loop is not None:
            self._loop.remove_reader(self._socket)
            self._loop = None
        self._socket.close()

    def _read(self) -> bool:
        """Take in what has arrived, and wake the call that waits for it as soon as it is a message; False if nothing
        has."""
        try:
            part = self._socket.recv(_READ_BYTES)
        except BlockingIOError:
            return False
        except OSError:
            part = b""
        self._received += part
        if not part:
            self._closed = True
            if self._loop is not None:
                self._loop.remove_reader(self._socket)
        if self._arrived is not None and (self._closed or self._end() <= len(self._received)):
            _wake(self._arrived)
        return True

    def _end(self) -> int:
        """End of the first message in the buffer, as far as known."""
        start = LENGTH.size
        return start + (LENGTH.unpack_from(self._received)[0] if len(self._received) >= start else 0)

    def _message(self) -> memoryview | None:
        """Remove and return the first complete message received."""
        end, received = self._end(), self._received
        if len(received) < end:
            return None
        self._received = received[end:]
        return memoryview(received)[LENGTH.size : end]


def _wake(arrived: asyncio.Future[None]) -> None:
    if not arrived.done():
        arrived.set_result(None)
