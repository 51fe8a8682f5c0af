"""Initial panels of a pin or a bushing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.pin.load.macaulay import breakpoints
from solvers.pin.scene import Scene
from solvers.pin.stations.lobatto_panels import Stations, panel_edges


def initial_stations(scene: Scene, further: tuple[float, ...] = ()) -> Stations:
    """Return stations on panels that are halves of the intervals between load boundaries, deflection reference points
    and the middle: up to the middle of a symmetric pin, otherwise over the whole length."""
    length, r = scene.geometry.length, scene.reference
    places = panel_edges({*breakpoints(scene.cases, length), r.left, r.right, *further}, length, scene.symmetric)
    edges, residuals = [0.0, *places, *(() if scene.symmetric else (length,))], dict(scene.geometry.places)
    whole = Stations(np.array(edges), np.array([residuals.get(edge, 0.0) for edge in edges]))
    return whole.halved(np.ones(whole.width.size, dtype=bool))


def kinks(scene: Scene) -> NDArray[np.float64]:
    """Return the positions, as fractions of the half, of load boundaries and deflection reference points of either
    half, including 0 and 1."""
    length, r = scene.geometry.length, scene.reference
    places = np.array([*breakpoints(scene.cases, length), r.left, r.right])
    fractions = np.minimum(places, length - places) / (0.5 * length)
    return np.unique(np.clip(np.concatenate([[0.0, 1.0], fractions]), 0.0, 1.0))
