"""What the template imports, so that every worker is born with it."""

import numba  # noqa: F401

import app.designs.registry  # noqa: F401
from app.jobs.calls import load_step_by_step

__all__ = ["load_step_by_step"]
