"""Which specs were asked for lately: the question that nearly always has the answer "no", without a query."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable


class RecentSpecs:
    """The hashes of the specs asked for last, the newest ``capacity`` of them.

    A spec that is not among them is solved anew, which is right in any case; one that is among them may have an answer
    in the store. So a night of different designs costs no lookups, and memory stays bounded (about 200 bytes a hash).
    """

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._hashes: OrderedDict[str, None] = OrderedDict()

    def __contains__(self, spec_hash: str) -> bool:
        return spec_hash in self._hashes

    def add(self, spec_hash: str) -> None:
        """Note a spec as the newest."""
        self._hashes[spec_hash] = None
        self._hashes.move_to_end(spec_hash)
        if len(self._hashes) > self._capacity:
            self._hashes.popitem(last=False)

    def fill(self, spec_hashes: Iterable[str]) -> None:
        """Note many, the oldest first."""
        for spec_hash in spec_hashes:
            self.add(spec_hash)
