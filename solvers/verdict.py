"""Whether a part holds: every figure that is judged, beside what is required of it.

A wing lists its own criteria (``solvers.rod.verdict`` and so on): what the request asks, and what the part must keep
anyway. Units are SI; the service words them.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable
from dataclasses import dataclass
from enum import StrEnum

from solvers.outcome import Accuracy, EffectReport, EffectState

MOST_SLACK = 1e-3
"""The most that a figure may miss what is required of it, relative, and still hold."""


MOST_UNSAID = 1e-2
"""What an effect left out may change, relative, before a caution says so: what ``auto`` leaves out by default."""


class Sense(StrEnum):
    """How a figure stands to what is required: not below it, not above it, the same, or a yes (1) that is no no (0)."""

    AT_LEAST = "at_least"
    AT_MOST = "at_most"
    EQUAL = "equal"
    YES = "yes"


@dataclass(frozen=True)
class Criterion:
    """One figure and what is required of it.

    name      of the request's field where it was asked for, else of the figure
    sense     on which side of ``required`` the figure must be
    reached   None: nothing acts that could break it, or it is not known, which does not hold; inf: without bound
    margin    how many times more the figure could bear, less 1: reached/required - 1 of a least value,
              required/reached - 1 of a greatest one; 0 where all of it is used; negative where it does not hold; None
              where nothing acts, nothing is known, or there is only a yes and no
    asked     whether the request asks for it, or every such part must keep it
    """

    name: str
    sense: Sense
    required: float
    reached: float | None
    margin: float | None
    holds: bool
    asked: bool


def slack_of(accuracy: Accuracy) -> float:
    """What a figure may miss, relative, and still hold: the accuracy asked for, as figures are exact to it only, and
    a design lies on its limits; but no more than ``MOST_SLACK``, so that a loose accuracy passes no part that fails."""
    return min(accuracy.requested, MOST_SLACK)


def at_least(name: str, required: float, reached: float | None, slack: float, asked: bool = True) -> Criterion:
    """``reached`` must not be below; None: nothing acts."""
    margin = None
    if reached is not None and required > 0.0:
        margin = reached / required - 1.0
    return _judged(name, Sense.AT_LEAST, required, reached, margin, slack, asked)


def at_most(name: str, required: float, reached: float | None, slack: float, asked: bool = True) -> Criterion:
    """``reached`` must not be above; None: nothing acts; inf: without bound."""
    margin = None
    if reached is not None and reached > 0.0:
        margin = required / reached - 1.0
    return _judged(name, Sense.AT_MOST, required, reached, margin, slack, asked)


def equal(name: str, required: float, reached: float, slack: float, asked: bool = True) -> Criterion:
    """``reached`` must be the same within the slack: its margin is what it is off, with a minus, or None."""
    off = abs(reached / required - 1.0)
    return Criterion(name, Sense.EQUAL, required, reached, None if off <= slack else -off, off <= slack, asked)


def yes(name: str, reached: bool, asked: bool = False) -> Criterion:
    """Something must be so."""
    return Criterion(name, Sense.YES, 1.0, float(reached), None if reached else -1.0, reached, asked)


def unknown(name: str, sense: Sense, required: float, asked: bool = True) -> Criterion:
    """What cannot be judged does not hold."""
    return Criterion(name, sense, required, None, None, False, asked)


def _judged(
    name: str, sense: Sense, required: float, reached: float | None, margin: float | None, slack: float, asked: bool
) -> Criterion:
    if margin is None or margin == math.inf:
        return Criterion(name, sense, required, reached, None, True, asked)
    holds = margin >= -slack
    return Criterion(name, sense, required, reached, max(margin, 0.0) if holds else margin, holds, asked)


def left_out(effects: Iterable[EffectReport], telling: Container[str]) -> tuple[str, ...]:
    """A caution for each effect that did not run and may change the judged figures by more than ``MOST_UNSAID``;
    ``telling`` are the effects that change any."""
    said = []
    for effect in effects:
        if effect.state is not EffectState.SKIPPED or effect.name not in telling:
            continue
        influence = effect.influence
        if influence > MOST_UNSAID:
            much = f"by up to {100.0 * influence:.2g} %" if influence < 1.0 else "by any amount"
            said.append(f"the effect {effect.name} is left out, which may change the figures {much}")
    return tuple(said)


@dataclass(frozen=True)
class Verdict:
    """Every criterion, and what to know beside them."""

    criteria: tuple[Criterion, ...]
    cautions: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether all of them hold."""
        return all(criterion.holds for criterion in self.criteria)

    @property
    def governing(self) -> Criterion | None:
        """The criterion that fails most, else the one with the least margin; None where nothing acts at all."""
        ranked = [c for c in self.criteria if c.margin is not None or not c.holds]
        return min(ranked, key=_rank, default=None)


def _rank(criterion: Criterion) -> tuple[bool, bool, float]:
    """Failing before holding, figures before what is not known."""
    unknown = criterion.margin is None
    return criterion.holds, unknown, 0.0 if unknown else criterion.margin
