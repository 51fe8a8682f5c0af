"""What a search with slightly different effects has found, so that gaps between resonances are not searched twice.

Effects are selected at the strip that a search finds, so that another search may follow with one of them more or less.
An effect that is hardly called for changes all strips by about the same: local optima that cost clearly more than the
best one still do, and the gaps between resonances without a good one remain without.
"""

from __future__ import annotations

from dataclasses import dataclass

from solvers.rod.optimum.search.local_search import LocalResult, is_among

MAX_INFLUENCE = 0.03
"""Greatest influence of the effects by which two searches differ for one to rely on the other."""
_SHARE = 0.2
"""Share of that influence by which the change of ln objective differs between local optima, at most."""


@dataclass(frozen=True)
class EarlierSearch:
    """What a search found.

    best             its best result
    ends             the results of its rough searches
    effects          those it included
    complete         whether all gaps between resonances were searched
    remaining_gain   the gain in ln objective that may remain there
    ratio_range      minimum and maximum frequency ratio searched
    influence        that of the effects by which the present search differs, relative
    """

    best: LocalResult
    ends: tuple[LocalResult, ...]
    effects: frozenset[str]
    complete: bool = False
    remaining_gain: float = 0.0
    ratio_range: tuple[float, float] | None = None
    influence: float = 0.0

    def starts(self) -> list[LocalResult]:
        """The ends that may be the best now, each strip once, the best first."""
        found, most = [self.best], self.best.at.log_cost + _SHARE * self.influence
        for end in sorted((end for end in self.ends if end.feasible), key=lambda end: end.at.log_cost):
            if end.at.log_cost < most and not is_among(end.at.x, found):
                found.append(end)
        return found
