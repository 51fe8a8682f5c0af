"""The four links as flat bars with eyes, assembled at the blow or at any angle of the crank."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from app.designs.drawing import (
    Arc,
    Circle,
    Dimension,
    Drawing,
    Layer,
    Line,
    Outline,
    Piece,
    Place,
    Straight,
    extent,
    words_of,
)
from app.designs.impact_linkage.mechanism_picture import standing
from app.designs.impact_linkage.pictures import bar_of
from app.designs.part import Extrusion, Parameter, Part, UnfitAngle

LINKS = ("base", "crank", "coupler", "rocker")
_AROUND = 720
_EYE = 0.25
"""Of the shortest link: the eyes' radius where the request gives the joints none."""
_HOLE, _THICKNESS, _BESIDE = 0.5, 1.0, 0.4
"""Of the eyes' radius: the holes', the links' thickness; of the shortest link: a hole's radius at most."""
_AT_THE_BLOW = 1e-9


def has_part(run: Mapping[str, Any]) -> bool:
    """Whether the run tells lengths."""
    return bool(run["status"] == "succeeded" and run["mode"] != "accuracy" and run["result"].get("lengths_mm"))


def part(run: Mapping[str, Any], angle_deg: float | None = None) -> Part:
    """The links, each in a layer of its own along z so that none is in another's way; the crank's pivot at 0.

    ``angle_deg`` is the crank's, from the blow in the direction of its turn; None: at the blow. Raises UnfitAngle where
    the crank cannot be there.
    """
    result = run["result"]
    lengths = {name: float(result["lengths_mm"][name]) for name in LINKS}
    eye, hole, assumed = _sizes(run["spec"], lengths)
    thickness = _THICKNESS * eye
    joints, way, told = _standing(result, lengths, angle_deg)
    ends = {"base": (0, 3), "crank": (0, 1), "coupler": (1, 2), "rocker": (3, 2)}
    solids, bars = [], []
    for layer, name in enumerate(LINKS):
        a, b = (joints[end] for end in ends[name])
        turn = math.degrees(math.atan2(b[1] - a[1], b[0] - a[0]))
        flat, holes = _bar(lengths[name], eye, hole)
        solids.append(Extrusion(name, flat, holes, layer * thickness, thickness, turn, a))
        bars.append(_placed(flat, a, math.atan2(b[1] - a[1], b[0] - a[0])))
    parameters = [
        *(Parameter(f"{name}_mm", lengths[name], "mm", f"between the joints of the {name}") for name in LINKS),
        Parameter("joint_radius_mm", eye, "mm", "outside of the eyes" + (", assumed" if assumed else "")),
        Parameter("joint_hole_radius_mm", hole, "mm", "assumed"),
        Parameter("link_thickness_mm", thickness, "mm", "assumed"),
        Parameter("crank_angle_deg", angle_deg or 0.0, "deg", "from the blow"),
    ]
    return Part(
        title="Impact linkage",
        solids=tuple(solids),
        parameters=tuple(parameters),
        drawing=_drawing(bars, joints, way, lengths, eye, hole, told),
        remarks=(told, "holes and thickness are assumed" + (", the eyes too" if assumed else "")),
    )


def _sizes(spec: Mapping[str, Any], lengths: Mapping[str, float]) -> tuple[float, float, bool]:
    """Radii of eyes and holes; whether the request left the eyes open."""
    least = min(lengths.values())
    given = spec["limits"]["joint_radius_mm"] or 0.0
    eye = given or _EYE * least
    return eye, min(_HOLE * eye, _BESIDE * least), not given


def _standing(
    result: Mapping[str, Any], lengths: Mapping[str, float], angle_deg: float | None
) -> tuple[list[Place], list[Place], str]:
    """The four joints, all places of the rocker's joint, and what is said of them."""
    base = lengths["base"]
    if not result["closure"]["closes"]:
        if angle_deg is not None:
            raise UnfitAngle("these lengths do not close: they have no such position", "no angle")
        pin, joint = (np.ravel(found) for found in standing(dict(lengths)))
        return [(0.0, 0.0), _place(pin), _place(joint), (base, 0.0)], [], "the lengths do not close; as they stand"
    angle, confined = angle_deg or 0.0, result["confined_deg"]
    turned = math.remainder(angle, 360.0)
    if confined is not None and abs(turned) > confined:
        raise UnfitAngle("the crank cannot get there", f"from -{confined:g} to {confined:g}")
    bar, crank = bar_of(dict(result)), lengths["crank"]
    phi = math.radians(turned) or _AT_THE_BLOW
    pin, joint = (crank * points[:, 0] for points in bar.joints(phi))
    reach = math.pi if confined is None else math.radians(confined)
    way = (crank * bar.joints(np.linspace(-reach, reach, _AROUND))[1]).T
    told = "at the blow" if angle_deg is None else f"{angle:g}° behind the blow"
    return [(0.0, 0.0), _place(pin), _place(joint), (base, 0.0)], [_place(p) for p in way], told


def _place(point: Any) -> Place:
    return float(point[0]), float(point[1])


def _bar(length: float, eye: float, hole: float) -> tuple[Outline, tuple[Circle, ...]]:
    """A link along x: round about both joints."""
    pieces = (
        Straight((length, -eye)), Arc((length, eye), 1.0), Straight((0.0, eye)), Arc((0.0, -eye), 1.0),
    )  # fmt: skip
    return Outline((0.0, -eye), pieces), (Circle((0.0, 0.0), hole), Circle((length, 0.0), hole))


def _placed(flat: Outline, shift: Place, angle: float) -> Outline:
    """An outline of straight lines and arcs, turned and moved."""
    cos, sin = math.cos(angle), math.sin(angle)

    def to(place: Place) -> Place:
        x, y = place
        return shift[0] + cos * x - sin * y, shift[1] + sin * x + cos * y

    pieces: list[Piece] = [
        Arc(to(piece.end), piece.bulge) if isinstance(piece, Arc) else Straight(to(piece.end)) for piece in flat.pieces
    ]
    return Outline(to(flat.start), tuple(pieces), flat.layer)


def convex_outline(circles: Sequence[tuple[Place, float]]) -> Outline:
    """The least convex outline around circles of one radius: straight lines and arcs."""
    radius = circles[0][1]
    corners = _hull([center for center, _ in circles])
    if len(corners) == 1:
        x, y = corners[0]
        return Outline((x - radius, y), (Arc((x + radius, y), 1.0), Arc((x - radius, y), 1.0)), Layer.HIDDEN)
    pieces: list[Piece] = []
    count = len(corners)
    ways = []
    for (x1, y1), (x2, y2) in ((corners[k], corners[(k + 1) % count]) for k in range(count)):
        size = math.hypot(x2 - x1, y2 - y1)
        ways.append(((x2 - x1) / size, (y2 - y1) / size))

    def beside(corner: Place, way: Place) -> Place:
        return corner[0] + radius * way[1], corner[1] - radius * way[0]

    start = beside(corners[0], ways[0])
    for k in range(count):
        corner, way, then = corners[(k + 1) % count], ways[k], ways[(k + 1) % count]
        pieces.append(Straight(beside(corner, way)))
        turn = math.atan2(way[0] * then[1] - way[1] * then[0], way[0] * then[0] + way[1] * then[1])
        turn = turn if turn > 0.0 else turn + 2.0 * math.pi if turn < -1e-9 else turn
        if turn > 1e-9 and radius > 0.0:
            pieces.append(Arc(beside(corner, then), math.tan(0.25 * turn)))
    return Outline(start, tuple(pieces), Layer.HIDDEN)


def _hull(places: Sequence[Place]) -> list[Place]:
    """Corners of the convex hull, counterclockwise (A. M. Andrew's monotone chain)."""
    rising = sorted(set(places))
    if len(rising) < 3:
        return rising

    def chain(ordered: Sequence[Place]) -> list[Place]:
        kept: list[Place] = []
        for x, y in ordered:
            while len(kept) > 1:
                (x1, y1), (x2, y2) = kept[-2:]
                if (x2 - x1) * (y - y1) - (y2 - y1) * (x - x1) > 0.0:
                    break
                kept.pop()
            kept.append((x, y))
        return kept[:-1]

    return chain(rising) + chain(rising[::-1])


def _drawing(
    bars: Sequence[Outline],
    joints: Sequence[Place],
    way: Sequence[Place],
    lengths: Mapping[str, float],
    eye: float,
    hole: float,
    told: str,
) -> Drawing:
    """The assembly from the front; dashed, the convex outline of all that the joints and their eyes sweep."""
    crank, base = lengths["crank"], lengths["base"]
    shapes: list[Outline | Circle | Line] = [*bars]
    shapes += [Circle(at, hole) for at in joints]
    shapes.append(Circle((0.0, 0.0), crank, Layer.CENTER))
    if way:
        shapes.append(Line(tuple(way), Layer.CENTER))
        around = np.linspace(0.0, 2.0 * math.pi, _AROUND, endpoint=False)
        circle = [(crank * math.cos(a), crank * math.sin(a)) for a in around]
        shapes.append(convex_outline([(place, eye) for place in (*circle, *way, (0.0, 0.0), (base, 0.0))]))
    below = min(y for shape in shapes for _, y in extent(shape))
    dimensions = []
    for number, name in enumerate(LINKS):
        y = below - (1.0 + number) * (3.2 * eye + 0.06 * max(lengths.values()))
        flat, holes = _bar(lengths[name], eye, hole)
        shapes += [_placed(flat, (0.0, y), 0.0), *(Circle((c.center[0], y), c.radius) for c in holes)]
        shapes.append(Line(((-1.3 * eye, y), (lengths[name] + 1.3 * eye, y)), Layer.CENTER))
        words = words_of(name, lengths[name])
        dimensions.append(Dimension((0.0, y), (lengths[name], y), words, "x", y + 1.4 * eye, 0, f"{name}_mm"))
    return Drawing(
        "The four links, to scale", tuple(shapes), tuple(dimensions), (),
        f"The four links {told}; dashed, the convex outline of what they sweep. Below, each by itself. mm, to scale.",
    )  # fmt: skip
