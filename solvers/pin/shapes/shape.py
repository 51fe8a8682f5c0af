"""What a form of bore or outside is: the lightest profile of its shape, with a bound that no such profile undercuts."""

from __future__ import annotations

from typing import Protocol

from solvers.pin.optimum.found import Found
from solvers.pin.optimum.program import Program


class Form(Protocol):
    """A family of profiles."""

    name: str

    def find(self, program: Program, gap: float) -> Found | None:
        """The lightest profile on the program's stations, its bound within ``gap`` where the form can promise that;
        None where even the solid pin deflects too much. ``program.lower`` holds no NaN."""
