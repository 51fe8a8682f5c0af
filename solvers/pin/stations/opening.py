"""Initial panels of a pin or a bushing."""

from __future__ import annotations

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
