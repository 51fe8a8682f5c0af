"""What the template imports, so that every worker is born with it."""

import numba  # noqa: F401

from app.designs.registry import KINDS
from app.jobs.calls import load_step_by_step

__all__ = ["load_step_by_step", "prepare_to_compile"]

for _kind in KINDS.values():
    pass  # looked up, and so imported


def prepare_to_compile() -> None:
    """Import what numba compiles by: two hundred modules, which each process that compiles would import for itself."""
    from numba.core.registry import cpu_target

    cpu_target.typing_context.refresh()
    cpu_target.target_context.refresh()
