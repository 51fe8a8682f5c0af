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
    known, edges = dict(scene.geometry.places), [(0.0, 0.0)]
    for place in (*places, *(() if scene.symmetric else (length,))):
        (begin, begin_residual), residual = edges[-1], known.get(place, 0.0)
        edges += [(begin + 0.5 * ((place - begin) + (residual - begin_residual)), 0.0), (place, residual)]
    return Stations(*np.array(edges).T.copy())


def kinks(scene: Scene) -> NDArray[np.float64]:
    """Return the positions, as fractions of the half, of load boundaries and deflection reference points of either
    half, including 0 and 1."""
    length, r = scene.geometry.length, scene.reference
    places = np.array([*breakpoints(scene.cases, length), r.left, r.right])
    fractions = np.minimum(places, length - places) / (0.5 * length)
    return np.unique(np.clip(np.concatenate([[0.0, 1.0], fractions]), 0.0, 1.0))
