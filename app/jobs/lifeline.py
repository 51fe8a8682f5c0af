"""No process outlives the one that it works for."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time

_PR_SET_PDEATHSIG = 1
_BETWEEN_LOOKS_S = 0.5


def die_with(parent: int) -> None:
    """From now on this process ends when its parent ``parent`` does, however that ends.

    Linux sends the signal itself, also to a process that is deep in native code. Elsewhere a thread looks who the
    parent is, twice a second.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    else:
        threading.Thread(target=_watch, args=(parent,), name="lifeline", daemon=True).start()
    if os.getppid() != parent:  # it died before it was watched
        os._exit(1)


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_BETWEEN_LOOKS_S)
    os._exit(1)
