"""A worker process as the service sees it: started, asked, killed, reaped."""

from __future__ import annotations

import asyncio
import os
import pickle
import socket
import struct
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Self

from app.designs.progress import Report, ignore_progress
from app.jobs.errors import BudgetExceeded, MemoryExceeded, SolveFailed, WorkerCrashed
from app.jobs.fork_server import START_TIMEOUT_S, Child, ForkServer
from app.jobs.worker import Reply, WorkerSettings, serve

LOAD_TIMEOUT_S = 120.0
"""Time limit for loading or compiling what a call needs; not counted in the call's own budget."""
_READ_BYTES = 1 << 18
_LARGE_BYTES = 1 << 18
"""Size of a message that is decoded in a thread, where it does not hold up other requests."""
_LENGTH = struct.Struct("!i")
"""What ``multiprocessing`` puts before a message."""


@dataclass(frozen=True)
class Call:
    """A solve: what to run, for how long, and where its progress goes."""

    kind_slug: str
    mode: str
    payload: bytes
    budget_s: float
    report: Report = ignore_progress


class Worker:
    """A live worker process and its pipe, which the event loop reads and writes itself: a thread between them would be
    woken twice for every request."""

    def __init__(self, child: Child, reap: Callable[[Child], int | None]) -> None:
        self._child, self._reap = child, reap
        self._socket = socket.socket(fileno=os.dup(child.connection.fileno()))
        self._socket.setblocking(False)
        self._received = bytearray()
        self._loaded: set[tuple[str, str]] = set()
        self.usable = True
        """Whether it waits for a call: false during one, and for ever if that did not end with a reply."""
        self.accepted = False
        """Whether it has said anything about its latest call; else it may have died before that began."""
        self.exit_code: Future[int | None] = Future()
        """Set when it was reaped; None if the fork server died with it or restarted since."""

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
        """Kill it, free what it held, and set its exit code. Blocks until the fork server has answered."""
        self.kill()
        self._socket.close()
        self.exit_code.set_result(self._reap(self._child))

    async def solve(self, call: Call) -> Any:
        """Its answer to the call.

        Raises BudgetExceeded, MemoryExceeded and SolveFailed; EOFError or OSError if the process has died;
        WorkerCrashed if it does not take the call. A worker that has not replied is no longer usable.
        """
        self.usable = self.accepted = False
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
        reply, deadline = Reply.PROGRESS, clock() + call.budget_s
        try:
            while reply is Reply.PROGRESS:
                reply, content = await self._receive(deadline)
                self.accepted = True
                if reply is Reply.PROGRESS:
                    call.report(content)
        except TimeoutError:
            raise BudgetExceeded(call.budget_s) from None
        if reply is Reply.MEMORY:
            raise MemoryExceeded("the solve exceeded the memory limit of a worker")
        self.usable = True
        if reply is Reply.ERROR:
            raise SolveFailed(*content)
        return content

    async def _send(self, message: tuple[str, str, bytes]) -> None:
        data = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
        async with asyncio.timeout(LOAD_TIMEOUT_S):
            await asyncio.get_running_loop().sock_sendall(self._socket, _LENGTH.pack(len(data)) + data)

    async def _receive(self, deadline: float) -> tuple[Reply, Any]:
        """The next message. Raises EOFError, and TimeoutError at the deadline [s] of the loop's clock."""
        loop = asyncio.get_running_loop()
        while (data := self._message()) is None:
            arrived = loop.create_future()
            timer = loop.call_at(deadline, _wake, arrived)
            loop.add_reader(self._socket, _wake, arrived)
            try:
                await arrived
            finally:
                loop.remove_reader(self._socket)
                timer.cancel()
            # What is there counts, even if the loop itself was too late to look.
            if not self._read() and loop.time() >= deadline:
                raise TimeoutError
        return await asyncio.to_thread(pickle.loads, data) if len(data) > _LARGE_BYTES else pickle.loads(data)

    def _read(self) -> bool:
        """Take in what has arrived; False if nothing has. Raises EOFError."""
        try:
            part = self._socket.recv(_READ_BYTES)
        except BlockingIOError:
            return False
        if not part:
            raise EOFError
        self._received += part
        return True

    def _message(self) -> bytes | None:
        """Remove and return the first complete message received."""
        start = _LENGTH.size
        if len(self._received) < start:
            return None
        end = start + _LENGTH.unpack_from(self._received)[0]
        if len(self._received) < end:
            return None
        data = bytes(memoryview(self._received)[start:end])
        del self._received[:end]
        return data


def _wake(arrived: asyncio.Future[None]) -> None:
    if not arrived.done():
        arrived.set_result(None)
