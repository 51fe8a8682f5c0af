"""Imports of the fork server, which every worker inherits."""

import numba  # noqa: F401

from app.designs.registry import KINDS
from app.jobs.calls import load_step_by_step

__all__ = ["load_step_by_step", "prepare_to_compile"]

for _kind in KINDS.values():
    pass  # importing happens on access


def prepare_to_compile() -> None:
    """Import numba's compiler: two hundred modules that each compiling process would otherwise import for itself."""
    from numba.core.registry import cpu_target

    cpu_target.typing_context.refresh()
    cpu_target.target_context.refresh()
