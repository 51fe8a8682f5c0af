"""Verdicts: each judged value with its requirement.

Each package lists its own criteria (``solvers.rod.verdict`` etc.): those of the request and those any part must meet.
Units are SI; the service provides the wording.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable
from dataclasses import dataclass
from enum import StrEnum
from operator import attrgetter
from typing import NamedTuple

from solvers.outcome import Accuracy, EffectReport, EffectState

MAX_SLACK = 1e-3
"""Maximum relative violation at which a criterion still counts as met."""

NEGLIGIBLE_ERROR = 1e-5
"""Relative error that puts no verdict in doubt: loads and materials are never known as well."""

_MARGIN = attrgetter("margin")

UNREPORTED_INFLUENCE = 1e-2
"""Relative influence of an omitted effect above which a caution is issued: the default tolerance of ``auto``."""


class Sense(StrEnum):
    """Required relation: not below, not above, equal, or yes (1) instead of no (0)."""

    AT_LEAST = "at_least"
    AT_MOST = "at_most"
    EQUAL = "equal"
    YES = "yes"


class Criterion(NamedTuple):
    """A judged value and its requirement.

    name      of the request's field if requested there, else of the quantity
    sense     required relation to ``required``
    reached   None: no load acts on it, or unknown (which does not hold); inf: unbounded
    margin    relative reserve: reached/required - 1 for a minimum, required/reached - 1 for a maximum; 0 if used up,
              negative if violated; None if no load acts, the value is unknown, or for yes/no criteria
    asked     whether the request asks for it, or any such part must meet it
    """

    name: str
    sense: Sense
    required: float
    reached: float | None
    margin: float | None
    holds: bool
    asked: bool


def slack_of(accuracy: Accuracy) -> float:
    """Relative slack of criteria: the requested accuracy, since values are no more accurate and designs lie on their
    limits; at most ``MAX_SLACK``, so that a loose accuracy cannot pass a failing part."""
    return min(accuracy.requested, MAX_SLACK)


def doubt(accuracy: Accuracy, designed: bool = False) -> float:
    """Relative error of the values within which a verdict is uncertain: the estimate, or 0 if that is within the slack
    or negligible.

    A design (``designed``) lies on its limits on purpose, so that it is certain if it has the accuracy requested."""
    expected = accuracy.estimated <= max(slack_of(accuracy), NEGLIGIBLE_ERROR) or (designed and accuracy.met)
    return 0.0 if expected else accuracy.estimated


def at_least(name: str, required: float, reached: float | None, slack: float, asked: bool = True) -> Criterion:
    """Requires ``reached`` >= ``required``; None: no load acts."""
    margin = None
    if reached is not None and required > 0.0:
        margin = reached / required - 1.0
    return _judged(name, Sense.AT_LEAST, required, reached, margin, slack, asked)


def at_most(name: str, required: float, reached: float | None, slack: float, asked: bool = True) -> Criterion:
    """Requires ``reached`` <= ``required``; None: no load acts; inf: unbounded."""
    margin = None
    if reached is not None and reached > 0.0:
        margin = required / reached - 1.0
    return _judged(name, Sense.AT_MOST, required, reached, margin, slack, asked)


def equal(name: str, required: float, reached: float, slack: float, asked: bool = True) -> Criterion:
    """Requires equality within the slack; the margin is minus the deviation, or None."""
    off = abs(reached / required - 1.0)
    return Criterion(name, Sense.EQUAL, required, reached, None if off <= slack else -off, off <= slack, asked)


def yes(name: str, reached: bool, asked: bool = False) -> Criterion:
    """A yes/no criterion."""
    return Criterion(name, Sense.YES, 1.0, float(reached), None if reached else -1.0, reached, asked)


def unknown(name: str, sense: Sense, required: float, asked: bool = True) -> Criterion:
    """An unknown value, which does not hold."""
    return Criterion(name, sense, required, None, None, False, asked)


def _judged(
    name: str, sense: Sense, required: float, reached: float | None, margin: float | None, slack: float, asked: bool
) -> Criterion:
    if margin is None or margin == math.inf:
        return Criterion(name, sense, required, reached, None, True, asked)
    holds = margin >= -slack
    return Criterion(name, sense, required, reached, max(margin, 0.0) if holds else margin, holds, asked)


def per_cent(share: float) -> str:
    """A share in per cent for a message: two digits without a padded exponent, from 100 on a whole number."""
    value = 100.0 * share
    return f"{value:.2g}".replace("e-0", "e-") if value < 99.5 else f"{value:.0f}"


def left_out(effects: Iterable[EffectReport], telling: Container[str]) -> tuple[str, ...]:
    """A caution for each omitted effect that may change the judged values by more than ``UNREPORTED_INFLUENCE``;
    ``telling``: effects that change any of them."""
    said = []
    for effect in effects:
        if effect.state is not EffectState.SKIPPED or effect.name not in telling:
            continue
        influence = effect.influence
        if influence > UNREPORTED_INFLUENCE:
            much = f"by up to {per_cent(influence)} %" if influence < 1.0 else "by any amount"
            said.append(f"the effect {effect.name} is left out, which may change the figures {much}")
    return tuple(said)


@dataclass(frozen=True)
class Verdict:
    """All criteria, and cautions.

    error     relative error of the values within which it is uncertain, see ``doubt``
    known     names of criteria whose values are known better
    """

    criteria: tuple[Criterion, ...]
    cautions: tuple[str, ...] = ()
    error: float = 0.0
    known: frozenset[str] = frozenset()

    @property
    def holds(self) -> bool:
        """Whether all criteria hold."""
        return all([criterion.holds for criterion in self.criteria])

    @property
    def certain(self) -> bool:
        """Whether an error of the values by ``error`` could not turn the verdict."""
        if self.error == 0.0:
            return True
        if self.holds:
            return not any(self._turns(c) for c in self.criteria)
        return not all(c.holds or self._turns(c) for c in self.criteria)

    @property
    def governing(self) -> Criterion | None:
        """The most violated criterion, otherwise the one with the smallest margin; of an uncertain verdict among those
        that make it so. None if no load acts at all."""
        doubtful = [] if self.certain else [c for c in self.criteria if self._turns(c)]
        failing = [c for c in self.criteria if not c.holds]
        # The margins of failing criteria are negative, those of the others are not. Unknown values come last.
        known = [c for c in doubtful or failing or self.criteria if c.margin is not None]
        return min(known, key=_MARGIN, default=failing[0] if failing else None)

    def _turns(self, criterion: Criterion) -> bool:
        """Whether an error of its value could turn a criterion."""
        error, margin = self.error, criterion.margin
        if criterion.name in self.known or margin is None:
            return False
        # A value that is too high by the error is (1 + margin)(1 - error) times its limit.
        return (1.0 + margin) * (1.0 - error) < 1.0 if criterion.holds else margin > max(-error, -1.0)
