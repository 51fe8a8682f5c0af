"""Interface of a form: the lightest profile of its family, with a proven lower bound."""

from __future__ import annotations

from typing import Protocol

from solvers.pin.optimum.found import Found
from solvers.pin.optimum.program import Program


class Form(Protocol):
    """A family of profiles."""

    name: str

    def find(self, program: Program, gap: float) -> Found | None:
        """Find the lightest profile on the program's stations, with its bound within ``gap`` if the form can achieve
        that.

        None if even the solid pin exceeds the deflection limit. ``program.lower`` contains no NaN.
        """
