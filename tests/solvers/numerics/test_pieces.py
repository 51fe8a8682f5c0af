"""Pieces between breaks."""

from __future__ import annotations

import numpy as np

from solvers.numerics import pieces


def test_subdivision_keeps_every_break():
    bounds = pieces.subdivide(np.array([0.0, 0.01, 1.0]), 0.1)
    assert {0.0, 0.01, 1.0} <= set(bounds)
    assert np.max(np.diff(bounds)) <= 0.1 + 1e-12
