"""A time limit ends a part wherever it is, even inside a kernel."""

from __future__ import annotations

import random

import numpy as np

from bench.campaign.seeds import TooLong, limited
from solvers.numerics.jit import kernel


@kernel
def halves(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two arrays; numba calls into Python for the type of each."""
    return 0.5 * values, 2.0 * values


def test_a_limit_within_a_compiled_kernel_is_a_limit():
    """One limit in seven fell into numba's Python code for a kernel's results, and surfaced as a SystemError."""
    values, draw, ended = np.ones(3), random.Random(1), 0
    halves(values)
    for _ in range(200):
        try:
            with limited(draw.uniform(1e-4, 3e-3)):
                while True:
                    halves(values)
        except TooLong as end:
            assert end.__context__ is None
            ended += 1
    assert ended == 200
