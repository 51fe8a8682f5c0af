"""Initial panels of a pin or a bushing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.pin.load.macaulay import breakpoints
from solvers.pin.scene import Scene
from solvers.pin.stations.lobatto_panels import Stations, first_stations, panel_edges


def end_of(scene: Scene) -> float:
    """Return the end of the stations: the middle of a symmetric pin, the far end of any other."""
    return scene.geometry.length * (0.5 if scene.symmetric else 1.0)


def opening_stations(scene: Scene, further: tuple[float, ...] = ()) -> Stations:
    """Return the initial panels, bounded by load boundaries, the middle, and the deflection reference points."""
    length, r = scene.geometry.length, scene.reference
    places = {*breakpoints(scene.cases, length), r.left, r.right, *further}
    return first_stations(panel_edges(places, length, scene.symmetric), end_of(scene), dict(scene.geometry.places))


def kinks(scene: Scene) -> NDArray[np.float64]:
    """Return the fractions of the half with a load boundary or deflection reference of either half, including 0 and
    1."""
    length, r = scene.geometry.length, scene.reference
    places = np.array([*breakpoints(scene.cases, length), r.left, r.right])
    shares = np.minimum(places, length - places) / (0.5 * length)
    return np.unique(np.clip(np.concatenate([[0.0, 1.0], shares]), 0.0, 1.0))
