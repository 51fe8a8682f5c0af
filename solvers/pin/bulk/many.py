"""Batch checks of pins and bushings, with the same results as ``check``.

Stepped bores under the rod force alone go through one compiled loop; all others are checked one by one.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass

from solvers.effects import AUTO, EffectSelection
from solvers.errors import InvalidInput
from solvers.outcome import Outcome
from solvers.pin.check import Prepared, check, prepare
from solvers.pin.closed_form.stepped import evaluate_all
from solvers.pin.limits import NO_LIMITS, Limits
from solvers.pin.result import PinCheck
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import CRITERIA, Criterion
from solvers.pin.shapes.given import Profile


@dataclass(frozen=True)
class Case:
    """The arguments of one ``check``."""

    scene: Scene
    profile: Profile
    criterion: Criterion = CRITERIA["tresca_paper"]
    limits: Limits = NO_LIMITS
    effects: EffectSelection = AUTO
    effect_tolerance: float = 1e-2
    accuracy: float = 1e-6

    def prepared(self) -> Prepared:
        """Return the check with its effects selected. Raises InvalidInput for an invalid request."""
        return prepare(
            self.scene, self.profile, self.criterion, self.limits, self.effects, self.effect_tolerance, self.accuracy
        )

    def alone(self) -> Outcome[PinCheck]:
        """Run this check on its own."""
        return check(
            self.scene, self.profile, self.criterion, self.limits, self.effects, self.effect_tolerance, self.accuracy
        )


def check_many(cases: Iterable[Case]) -> list[Outcome[PinCheck] | InvalidInput]:
    """Return one outcome per case, in input order; an invalid case yields its InvalidInput."""
    found: list[Outcome[PinCheck] | InvalidInput | None] = []
    rows: list[tuple[int, Prepared]] = []
    for case in cases:
        try:
            prepared = case.prepared()
            if prepared.stepped is None:
                found.append(prepared.on_stations())
            else:
                rows.append((len(found), prepared))
                found.append(None)
        except InvalidInput as refusal:
            found.append(refusal)
    began = time.perf_counter()
    results = evaluate_all([prepared.stepped for _, prepared in rows])
    share = (time.perf_counter() - began) / max(len(rows), 1)
    for row, (place, prepared) in enumerate(rows):
        try:
            found[place] = prepared.in_closed_form(results, row, share)
        except InvalidInput as refusal:
            found[place] = refusal
    return found  # type: ignore[return-value]
