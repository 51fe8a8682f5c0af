"""What the template imports, so that every worker is born with it."""

import numba  # noqa: F401

from app.designs.registry import KINDS
from app.jobs.calls import load_step_by_step

__all__ = ["load_step_by_step"]

for _kind in KINDS.values():
    pass  # looked up, and so imported
