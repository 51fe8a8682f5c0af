"""A fork server: a process with the solvers already imported, from which workers are forked within milliseconds.

The service controls it through a socket with nine-byte messages, a command letter and a number:

F   fork a child with the two descriptors sent along; replies with its process id
C n reap child n, which has ended; replies with its exit code
E   load the next of what the preloaded module has to load; replies 1, or 0 if nothing is left
P   import numba's compiler modules, so that no child has to

Each child gets one end of a pipe, on which it receives what to run, and the write end of another pipe, whose closing
signals that it has ended. The server forks from a single thread and closes its own copies of both at once.
"""

from __future__ import annotations

import array
import contextlib
import importlib
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

from app.importing import gc_paused
from app.jobs.errors import WorkerCrashed
from app.jobs.parent_death import die_with_parent

START_TIMEOUT_S = 120.0
"""Time limit for the fork server's imports."""

_MESSAGE = struct.Struct("<cq")

_BOOTSTRAP = (
    "import sys; sys.path[:] = {path!r}; "
    "from app.jobs.fork_server import main; main({descriptor}, {parent}, {preload!r})"
)


@dataclass(frozen=True)
class Child:
    """A forked process: its pipe, and a descriptor that is closed when it ends."""

    pid: int
    connection: Connection
    sentinel: int
    generation: int

    @property
    def alive(self) -> bool:
        poller = select.poll()
        poller.register(self.sentinel, select.POLLIN)
        return not poller.poll(0)

    def kill(self) -> None:
        # The process id cannot be reused before the child is reaped.
        if self.alive:
            os.kill(self.pid, signal.SIGKILL)

    def close(self) -> None:
        self.connection.close()
        os.close(self.sentinel)


class ForkServer:
    """The service's handle on the fork server.

    Call ``start`` from a thread that lives as long as the server should: Linux sends the parent-death signal when the
    thread that started a process ends, not the whole process.
    """

    def __init__(self, preload: str) -> None:
        self._preload = preload
        self._process: subprocess.Popen[bytes] | None = None
        self._control: socket.socket | None = None
        self._lock, self._state_changed = threading.Lock(), threading.Condition(threading.RLock())
        self._closed = False
        self.generation = 0
        """Number of starts so far."""

    @property
    def alive(self) -> bool:
        process = self._process
        return process is not None and process.poll() is None

    @property
    def pid(self) -> int | None:
        return None if self._process is None else self._process.pid

    def start(self) -> None:
        """Start or restart the server, without blocking; ``fork`` may be called while it still imports."""
        with self._state_changed:
            self._stop()
            if not self._closed:
                self._spawn()
            self._state_changed.notify_all()

    def _spawn(self) -> None:
        ours, theirs = socket.socketpair()
        ours.settimeout(START_TIMEOUT_S)
        code = _BOOTSTRAP.format(path=sys.path, descriptor=theirs.fileno(), parent=os.getpid(), preload=self._preload)
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

    def fork(self, target: Callable[..., None], *arguments: Any, wait_s: float = START_TIMEOUT_S) -> Child:
        """Fork a child that runs ``target(connection, *arguments)``, both pickled.

        The pool's supervisor restarts a server that has died; ``wait_s`` is how long to wait for that. Raises
        WorkerCrashed on failure.
        """
        with self._state_changed:
            if not self._state_changed.wait_for(lambda: self._closed or self.alive, wait_s):
                raise WorkerCrashed(None)
        ours, theirs = Pipe()
        sentinel, write_end = os.pipe()
        generation = self.generation
        try:
            pid = self._request(b"F", 0, [theirs.fileno(), write_end])
        except BaseException:
            ours.close()
            os.close(sentinel)
            raise
        finally:
            theirs.close()
            os.close(write_end)
        child = Child(pid, ours, sentinel, generation)
        try:
            ours.send((target, arguments))
        except OSError as error:
            child.kill()
            raise WorkerCrashed(self.exit_code(child)) from error
        return child

    def exit_code(self, child: Child) -> int | None:
        """Reap a dead child; its exit code, or None if it is no longer known."""
        child.close()
        if child.generation != self.generation:
            return None
        try:
            return self._request(b"C", child.pid, [])
        except WorkerCrashed:
            return None

    def load_next(self) -> bool:
        """Load the kernels of another kind and mode, or a library, so that workers forked later inherit them; False if
        nothing is left. Raises WorkerCrashed."""
        return bool(self._request(b"E", 0, []))

    def prepare_to_compile(self) -> None:
        """Import numba's compiler modules. Raises WorkerCrashed."""
        self._request(b"P", 0, [])

    def close(self) -> None:
        """Kill the server and every process forked from it."""
        with self._state_changed:
            self._closed = True
            self._stop()
            self._state_changed.notify_all()

    def _request(self, command: bytes, number: int, descriptors: list[int]) -> int:
        with self._lock:
            control = self._control
            if control is None or self._closed:
                raise WorkerCrashed(None)
            try:
                ancillary = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors))]
                control.sendmsg([_MESSAGE.pack(command, number)], ancillary if descriptors else [])
                reply = control.recv(_MESSAGE.size, socket.MSG_WAITALL)
            except OSError as error:
                raise WorkerCrashed(None) from error
            if len(reply) < _MESSAGE.size:
                raise WorkerCrashed(None)
            return int(_MESSAGE.unpack(reply)[1])

    def _stop(self) -> None:
        process, control = self._process, self._control
        if process is None or control is None:
            return
        # Process and group ids cannot be reused before wait().
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
    """Main function of the fork-server process."""
    die_with_parent(parent)
    # Ctrl-C in a terminal signals the whole process group; the service decides when workers end.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    control = socket.socket(fileno=descriptor)
    with gc_paused():
        module = importlib.import_module(preload)
    steps: Iterator[None] | None = None
    while True:
        data, descriptors, _, _ = socket.recv_fds(control, _MESSAGE.size, 2)
        if len(data) < _MESSAGE.size:
            os._exit(0)
        command, number = _MESSAGE.unpack(data)
        answer = 0
        if command == b"F":
            answer = _fork(control, descriptors)
        elif command == b"C":
            answer = os.waitstatus_to_exitcode(os.waitpid(number, 0)[1])
        elif command == b"E":
            steps = steps or module.load_step_by_step()
            answer = _step(steps)
        elif command == b"P":
            module.prepare_to_compile()
        control.sendall(_MESSAGE.pack(command, answer))


def _step(steps: Iterator[None]) -> int:
    """Take the next step; 0 if there was none, or it failed: the call that needs it will report why."""
    with gc_paused(), contextlib.suppress(Exception):
        return int(next(steps, steps) is not steps)
    return 0


def _fork(control: socket.socket, descriptors: list[int]) -> int:
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            control.close()
            die_with_parent(parent)
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
