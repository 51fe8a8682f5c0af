"""What a search with slightly different effects has found, so that gaps between resonances are not searched twice.

Effects are selected at the strip that a search finds, so that another search may follow with one of them more or less.
An effect that is hardly called for changes all strips by about the same: local optima that cost clearly more than the
best one still do, and the gaps between resonances without a good one remain without.
"""

from __future__ import annotations

from dataclasses import dataclass

from solvers.rod.optimum.search.local_search import LocalResult, is_among
from solvers.rod.optimum.search.optimum import Optimum

MAX_INFLUENCE = 0.03
"""Greatest influence of the effects by which two searches differ for one to rely on the other."""
_SHARE = 0.2
"""Share of that influence by which the change of ln objective differs between local optima, at most."""


@dataclass(frozen=True)
class EarlierSearch:
    """The best strip, the local optima of rough searches, and whether all gaps between resonances were searched.

    ``influence`` is that of the effects by which the present search differs, relative.
    """

    optimum: Optimum
    ends: tuple[LocalResult, ...]
    complete: bool
    influence: float = 0.0

    def starts(self) -> list[LocalResult]:
        """The ends that may be the best now, each strip once, the best first."""
        found = [self.optimum.local]
        most = found[0].at.log_cost + _SHARE * self.influence
        for end in sorted((end for end in self.ends if end.feasible), key=lambda end: end.at.log_cost):
            if end.at.log_cost < most and not is_among(end.at.x, found):
                found.append(end)
        return found
