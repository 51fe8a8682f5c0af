"""A sized linkage: its four lengths, its rotatability and its ability to strike."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

from solvers.errors import InvalidInput, require_positive
from solvers.linkage.mechanism.change_point import ChangePoint, plain_ratios
from solvers.linkage.mechanism.closure import Closure, crank_angle_limit, nearest_kind, rotates_fully
from solvers.linkage.mechanism.kinematics import FourBar

_NAMES = ("base", "crank", "coupler", "rocker")


@dataclass(frozen=True)
class Lengths:
    """Links [m]: base l0, crank l1, coupler l2, rocker l3. Raises InvalidInput for links that cannot close."""

    base: float
    crank: float
    coupler: float
    rocker: float

    def __post_init__(self) -> None:
        require_positive(self, "lengths", *_NAMES)
        longest = max(self.links)
        if not longest < self.base + self.crank + self.coupler + self.rocker - longest:
            name = _NAMES[self.links.index(longest)]
            raise InvalidInput(f"lengths.{name}", "the other links cannot reach around it", "less than their sum")

    @property
    def links(self) -> tuple[float, float, float, float]:
        """Base, crank, coupler, rocker [m]."""
        return self.base, self.crank, self.coupler, self.rocker


@dataclass(frozen=True)
class Mechanism:
    """A linkage to evaluate: kind and ratios, crank length [m], and closure error."""

    bar: FourBar
    crank: float
    closure: Closure = field(default_factory=Closure)

    @cached_property
    def links(self) -> tuple[float, float, float, float]:
        """Base, crank, coupler, rocker [m]."""
        r = self.bar.ratios
        return self.crank * r.base, self.crank, self.crank * r.coupler, self.crank * r.rocker

    @property
    def lengths(self) -> Lengths:
        return Lengths(*self.links)

    @cached_property
    def rotatable(self) -> bool:
        """Whether the crank rotates fully."""
        return self.bar.rotatable if self.closure.closes else rotates_fully(*self.links)

    @property
    def can_strike(self) -> bool:
        """Whether the links close and the rocker can reverse at the blow."""
        return self.closure.closes and self.bar.reverses

    @cached_property
    def confined(self) -> float | None:
        """Maximum crank angle [rad] on either side of the blow; None if unlimited."""
        return None if self.rotatable else crank_angle_limit(self.bar)


@lru_cache(maxsize=32)
def of_lengths(lengths: Lengths, preferred: ChangePoint | None = None) -> Mechanism:
    """A mechanism of given lengths, as the kind with the smallest closure error.

    ``preferred`` is chosen if the lengths close as more than one kind.
    """
    kind, closure = nearest_kind(*lengths.links, preferred)
    ratios = plain_ratios(lengths.base, lengths.coupler, lengths.rocker, lengths.crank)
    return Mechanism(FourBar(kind, ratios), lengths.crank, closure)
