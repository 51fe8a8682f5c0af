"""What a search with slightly different effects has found, so that gaps between resonances are not searched twice.

Effects are selected at the strip that a search finds, so that another search may follow with one effect more or less.
An effect of little influence changes all strips by about the same amount: local optima that cost clearly more than the
best one still do, and gaps between resonances without a good strip remain without one.
"""

from __future__ import annotations

from dataclasses import dataclass

from solvers.rod.optimum.search.local_search import LocalResult, is_among
from solvers.rod.optimum.search.optimum import Optimum

MAX_INFLUENCE = 0.03
"""Greatest relative influence of the effects by which two searches differ up to which one relies on the other."""
_SHARE = 0.2
"""Greatest difference between the changes of two local optima's ln objective, as a share of that influence."""


@dataclass(frozen=True)
class EarlierSearch:
    """What a search found.

    optimum      its best result, at full accuracy if ``complete``
    ends         the results of its searches at low accuracy
    effects      the effects it included
    complete     whether all gaps between resonances were searched; if not, only searches of discrete sizes rely on it
    influence    relative influence of the effects by which the present search differs
    """

    optimum: Optimum
    ends: tuple[LocalResult, ...]
    effects: frozenset[str]
    complete: bool
    influence: float = 0.0

    def starts(self) -> list[LocalResult]:
        """The ends that may be the best now, each strip once, the best first."""
        best = self.optimum.local
        found, most = [best], best.at.log_cost + _SHARE * self.influence
        for end in sorted((end for end in self.ends if end.feasible), key=lambda end: end.at.log_cost):
            if end.at.log_cost < most and not is_among(end.at.x, found):
                found.append(end)
        return found
