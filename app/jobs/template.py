"""The process that workers are forked from: it has the solvers imported, so that a worker is born in milliseconds.

The service talks to it through a socket, nine bytes a message: a letter and a number.

    F   fork a child on the two descriptors that come along; answered with its process id
    C n wait for child n, which has ended; answered with its exit code
    E   load the kernels that are on disk, while nobody asks for anything
    P   import what kernels are compiled by, so that no child has to

A child is handed one end of a pipe, on which it is told what to run, and a descriptor that says by being closed that
the child has ended. The template forks from a single thread, and forgets both at once.
"""

from __future__ import annotations

import array
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

from app.importing import undisturbed
from app.jobs.errors import WorkerCrashed
from app.jobs.lifeline import die_with

START_TIMEOUT_S = 120.0
"""How long the template may import."""

_MESSAGE = struct.Struct("<cq")
_QUIET_S = 1.0
"""So long nobody must have asked for anything before the template loads kernels beside."""

_BEGIN = (
    "import sys; sys.path[:] = {path!r}; from app.jobs.template import main; main({descriptor}, {parent}, {preload!r})"
)


@dataclass(frozen=True)
class Child:
    """A process that was forked: the pipe to it, and the descriptor that is closed when it ends."""

    pid: int
    connection: Connection
    sentinel: int
    generation: int

    @property
    def alive(self) -> bool:
        look = select.poll()
        look.register(self.sentinel, select.POLLIN)
        return not look.poll(0)

    def kill(self) -> None:
        # As long as nobody asked for its exit code, its number is its own.
        if self.alive:
            os.kill(self.pid, signal.SIGKILL)

    def forget(self) -> None:
        self.connection.close()
        os.close(self.sentinel)


class Template:
    """The service's side. ``start`` must be called from a thread that lives as long as the template should.

    (Linux counts the end of the thread that started a process as the end of its parent.)
    """

    def __init__(self, preload: str) -> None:
        self._preload = preload
        self._process: subprocess.Popen[bytes] | None = None
        self._control: socket.socket | None = None
        self._lock, self._life = threading.Lock(), threading.Condition(threading.RLock())
        self._closed = False
        self.generation = 0
        """How often it was started."""

    @property
    def alive(self) -> bool:
        process = self._process
        return process is not None and process.poll() is None

    @property
    def pid(self) -> int | None:
        return None if self._process is None else self._process.pid

    def start(self) -> None:
        """Start it, or start it again. Returns at once; children can be asked for while it still imports."""
        with self._life:
            self._end()
            if not self._closed:
                self._begin()
            self._life.notify_all()

    def _begin(self) -> None:
        ours, theirs = socket.socketpair()
        ours.settimeout(START_TIMEOUT_S)
        code = _BEGIN.format(path=sys.path, descriptor=theirs.fileno(), parent=os.getpid(), preload=self._preload)
        try:
            process = subprocess.Popen(
                [sys.executable, "-c", code], pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, process_group=0
            )
        except OSError:
            ours.close()
            raise
        finally:
            theirs.close()
        self._process, self._control = process, ours
        self.generation += 1

    def fork(self, target: Callable[..., None], *arguments: Any) -> Child:
        """A child that runs ``target(connection, *arguments)``, both sent by name. Raises WorkerCrashed without one."""
        with self._life:
            # One that has ended is started again by whoever keeps it.
            if not self._life.wait_for(lambda: self._closed or self.alive, START_TIMEOUT_S):
                raise WorkerCrashed(None)
        ours, theirs = Pipe()
        sentinel, mark = os.pipe()
        generation = self.generation
        try:
            pid = self._ask(b"F", 0, [theirs.fileno(), mark])
        except BaseException:
            ours.close()
            os.close(sentinel)
            raise
        finally:
            theirs.close()
            os.close(mark)
        child = Child(pid, ours, sentinel, generation)
        try:
            ours.send((target, arguments))
        except OSError as error:
            child.forget()
            raise WorkerCrashed(None) from error
        return child

    def exit_code(self, child: Child) -> int | None:
        """How a child that has ended ended; None when nobody knows any more. The child is forgotten."""
        child.forget()
        if child.generation != self.generation:
            return None
        try:
            return self._ask(b"C", child.pid, [])
        except WorkerCrashed:
            return None

    def load_when_idle(self) -> None:
        """Let it take up the kernels that are on disk, so that workers forked later have them."""
        self._ask(b"E", 0, [])

    def prepare_to_compile(self) -> None:
        """Let it import what kernels are compiled by. Raises WorkerCrashed."""
        self._ask(b"P", 0, [])

    def close(self) -> None:
        """Kill it and everything that was forked from it."""
        with self._life:
            self._closed = True
            self._end()
            self._life.notify_all()

    def _ask(self, letter: bytes, number: int, descriptors: list[int]) -> int:
        with self._lock:
            control = self._control
            if control is None or self._closed:
                raise WorkerCrashed(None)
            try:
                ancillary = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors))]
                control.sendmsg([_MESSAGE.pack(letter, number)], ancillary if descriptors else [])
                told = control.recv(_MESSAGE.size, socket.MSG_WAITALL)
            except OSError as error:
                raise WorkerCrashed(None) from error
            if len(told) < _MESSAGE.size:
                raise WorkerCrashed(None)
            return int(_MESSAGE.unpack(told)[1])

    def _end(self) -> None:
        process, control = self._process, self._control
        if process is None or control is None:
            return
        # Its number, and so that of its group, is its own until it is waited for.
        if process.returncode is None:
            _kill_group(process.pid)
        process.wait()
        control.close()
        self._process, self._control = None, None


def _kill_group(group: int) -> None:
    try:
        os.killpg(group, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        return


def main(descriptor: int, parent: int, preload: str) -> None:
    """The template's own main function."""
    die_with(parent)
    # Ctrl-C in a terminal goes to the whole process group; the service decides when its workers end.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    control = socket.socket(fileno=descriptor)
    steps: Iterator[None] | None = None
    with undisturbed():
        module = __import__(preload, fromlist=["load_step_by_step"])
    while True:
        if not select.select([control], [], [], None if steps is None else _QUIET_S)[0]:
            steps = _one_more(steps)
            continue
        data, descriptors, _, _ = socket.recv_fds(control, _MESSAGE.size, 2)
        if len(data) < _MESSAGE.size:
            os._exit(0)
        letter, number = _MESSAGE.unpack(data)
        answer = 0
        if letter == b"F":
            answer = _fork(control, descriptors)
        elif letter == b"C":
            answer = os.waitstatus_to_exitcode(os.waitpid(number, 0)[1])
        elif letter == b"E":
            steps = module.load_step_by_step()
        elif letter == b"P":
            module.prepare_to_compile()
        control.sendall(_MESSAGE.pack(letter, answer))


def _one_more(steps: Iterator[None] | None) -> Iterator[None] | None:
    if steps is not None and next(steps, steps) is steps:
        return None
    return steps


def _fork(control: socket.socket, descriptors: list[int]) -> int:
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            control.close()
            die_with(parent)
            connection = Connection(descriptors[0])
            target, arguments = connection.recv()
            target(connection, *arguments)
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stderr.flush()
            os._exit(code)
    for each in descriptors:
        os.close(each)
    return pid
