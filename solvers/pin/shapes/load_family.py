"""Free profiles over the load magnitude: the paper's figure 5, for pins and for bushings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from solvers.numerics.arrays import Array
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.optimum.program import constraints_at
from solvers.pin.scene import Scene
from solvers.pin.section.criteria import Criterion


@dataclass(frozen=True)
class LoadProfile:
    """One member of the family: force [N], positions [m], and the sought diameter there [m]; NaN where infeasible."""

    force: float
    x: Array
    diameter: Array


def free_sizes(scene: Scene, criterion: Criterion, force: float, x: Array) -> Array:
    """Return the maximum bore of a pin or the minimum outer diameter of a bushing [m] at positions ``x`` for a force
    [N].

    No limits on wall and deflection; NaN where infeasible. A single pass over the stations.
    """
    loaded = scene if force == scene.force else replace(scene, force=force)
    variable = design_variable_of(scene)
    return variable.sizes(variable.least_walls(constraints_at(loaded, criterion, x, x), 0.0, x.size))


def load_sweep(
    scene: Scene, criterion: Criterion, forces: Sequence[float], places: int = 121
) -> tuple[LoadProfile, ...]:
    """Return the free profile of every force, from the end to the middle; the ends of the gap are included."""
    g = scene.geometry
    kinks = [g.boss_length, g.boss_length + g.gap]
    x = np.unique(np.concatenate([np.linspace(0.0, 0.5 * g.length, places), kinks]))
    return tuple(LoadProfile(force, x, free_sizes(scene, criterion, force, x)) for force in forces)
