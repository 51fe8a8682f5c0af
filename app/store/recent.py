"""A cache of recent spec hashes, which answers "not seen" without a query."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable


class RecentSpecs:
    """The ``capacity`` most recent spec hashes.

    A miss only means solving again, which is always correct; a hit means that the store may hold an answer. Streams of
    distinct requests thus cost no lookups, in bounded memory (about 200 bytes per hash).
    """

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._hashes: OrderedDict[str, None] = OrderedDict()

    def __contains__(self, spec_hash: str) -> bool:
        return spec_hash in self._hashes

    def add(self, spec_hash: str) -> None:
        """Add a hash as the most recent."""
        self._hashes[spec_hash] = None
        self._hashes.move_to_end(spec_hash)
        if len(self._hashes) > self._capacity:
            self._hashes.popitem(last=False)

    def fill(self, spec_hashes: Iterable[str]) -> None:
        """Add several, oldest first."""
        for spec_hash in spec_hashes:
            self.add(spec_hash)
