"""Motions of single panels of the turn joined to a periodic one.

Between two corners of the force the motion is that of slow modes, which anything may have set going, with fast ones that
follow (``slow_modes``), and of fast modes that ring freely (``free_modes``). At a corner amplitudes and speeds of all
are continuous; what the fast ones would do on its two sides is not, and the difference rings.

A panel's ends are matrices whose rows are its unknowns (the slow modes' first states, real and imaginary parts of the
ringing) and, last, what is there by itself; columns are states: amplitudes of slow modes, their speeds, then those of
the fast modes that ring. Speeds are times sqrt(mu), so that a free motion keeps its length.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def closed(lefts: Array, rights: Array) -> tuple[Array, float]:
    """The unknowns of every panel (panels, unknowns) from the panels' ends, (panels, unknowns + 1, unknowns) each, and
    the greatest factor by which closing the turn enlarges what one turn misses."""
    count, unknowns = lefts.shape[0], lefts.shape[2]
    if unknowns == 0:
        return np.empty((count, 0)), 1.0
    after = np.roll(lefts, -1, axis=0)
    rights = rights.copy()
    rights[:, -1] -= after[:, -1]
    steps = np.linalg.solve(after[:, :-1].transpose(0, 2, 1), rights.transpose(0, 2, 1)).transpose(0, 2, 1)
    whole = np.eye(unknowns + 1, unknowns)
    for step in steps:
        whole = whole @ step[:-1]
        whole[-1] += step[-1]
    closing = np.eye(unknowns) - whole[:-1]
    least = float(np.linalg.svd(closing, compute_uv=False)[-1])
    found = np.empty((count, unknowns))
    found[0] = np.linalg.solve(closing.T, whole[-1]) if least > 0.0 else np.inf
    for k, step in enumerate(steps[:-1]):
        found[k + 1] = found[k] @ step[:-1] + step[-1]
    return found, 1.0 / least if least > 0.0 else np.inf
