"""Child processes of tests that end with the test runner, even if it is killed."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial

from app.jobs.parent_death import die_with_parent


def die_with_test_runner() -> Callable[[], None]:
    """A ``preexec_fn`` that makes the child die with the thread that starts it."""
    return partial(die_with_parent, os.getpid())
