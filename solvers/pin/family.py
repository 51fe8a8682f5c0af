"""Profiles over the load's intensity: the paper's figure 5."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from solvers.pin.program import demands_at
from solvers.pin.scene import Scene
from solvers.pin.section import Criterion, least_wall

Array = NDArray[np.float64]


def free_bores(scene: Scene, criterion: Criterion, force: float, x: Array) -> Array:
    """The greatest bore [m] at places ``x`` for a force [N], wall and stiffness unlimited; NaN where none holds.

    One pass over the stations: this is the free profile in bulk.
    """
    wall = np.zeros_like(x)
    for demand in demands_at(replace(scene, force=force), criterion, x, x):
        wall = np.maximum(wall, least_wall(demand))
    return scene.geometry.outer_diameter * (1.0 - wall)
