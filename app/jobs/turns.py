"""Round robin among waiting parties."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable, Iterable
from typing import Generic, TypeVar

K = TypeVar("K", bound=Hashable)


class Turns(Generic[K]):
    """Chooses the party served least recently, or the first of those never served. Remembers the ``memory`` most recent
    ones."""

    def __init__(self, memory: int = 10_000) -> None:
        self._memory, self._count = memory, 0
        self._latest: OrderedDict[K, int] = OrderedDict()

    def next(self, waiting: Iterable[K]) -> K:
        """The party whose turn it is. Raises ValueError if none is waiting."""
        return min(waiting, key=lambda each: self._latest.get(each, 0))

    def served(self, who: K) -> None:
        """Record that a party has had its turn."""
        self._count += 1
        self._latest[who] = self._count
        self._latest.move_to_end(who)
        if len(self._latest) > self._memory:
            self._latest.popitem(last=False)
