"""Search for the piece of a piecewise function that contains a point."""

from __future__ import annotations

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel


@kernel
def piece_at(starts: Array, place: float, near: int) -> int:
    """Return the last piece that starts at or before ``place``, the first if none does; ``starts`` ascend.

    The search begins at piece ``near``: for ascending places it is usually that piece or the next.
    """
    k = near
    while k > 0 and starts[k] > place:
        k -= 1
    while k + 1 < starts.size and starts[k + 1] <= place:
        k += 1
    return k
