"""What tests start ends with them, also where their runner is killed and no fixture comes to its end."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial

from app.jobs.lifeline import die_with


def mortal() -> Callable[[], None]:
    """For ``preexec_fn``: the process that is started ends when the thread that starts it does."""
    return partial(die_with, os.getpid())
