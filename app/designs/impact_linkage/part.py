"""The four links as flat bars with eyes, assembled at the blow or at any crank angle."""

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
from app.designs.impact_linkage.mechanism_picture import LINKS, standing
from app.designs.impact_linkage.pictures import bar_of
from app.designs.impact_linkage.swept import outline, segments_of
from app.designs.part import Extrusion, Parameter, Part, UnfitAngle

_POSITIONS = 720
_EYE = 0.25
"""Eye radius relative to the shortest link, if the request does not specify the joints."""
_HOLE, _THICKNESS, _MAX_HOLE = 0.5, 1.0, 0.4
"""Hole radius and link thickness relative to the eye radius; maximum hole radius relative to the shortest link."""
_AT_THE_BLOW = 1e-9


def part(run: Mapping[str, Any], angle_deg: float | None = None) -> Part:
    """The links, each in its own layer along z so that they do not collide; the crank's pivot is the origin.

    ``angle_deg`` is the crank angle from the blow in its direction of rotation; None: at the blow. Raises UnfitAngle if
    the crank cannot reach it.
    """
    result = run["result"]
    lengths = {name: float(result["lengths_mm"][name]) for name in LINKS}
    eye, hole, assumed = _sizes(run["spec"], lengths)
    thickness = _THICKNESS * eye
    joints, way, position = _standing(result, lengths, angle_deg)
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
        drawing=_drawing(bars, joints, way, lengths, eye, hole, position),
        remarks=(position, "holes and thickness are assumed" + (", the eyes too" if assumed else "")),
    )


def _sizes(spec: Mapping[str, Any], lengths: Mapping[str, float]) -> tuple[float, float, bool]:
    """Radii of eyes and holes; whether the eyes are not specified in the request."""
    least = min(lengths.values())
    given = spec["limits"]["joint_radius_mm"] or 0.0
    eye = given or _EYE * least
    return eye, min(_HOLE * eye, _MAX_HOLE * least), not given


def _standing(
    result: Mapping[str, Any], lengths: Mapping[str, float], angle_deg: float | None
) -> tuple[list[Place], list[tuple[Place, Place]], str]:
    """The four joints, all positions of crank pin and rocker joint, and a remark."""
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
    pins, ends = (crank * points.T for points in bar.joints(np.linspace(-reach, reach, _POSITIONS)))
    position = "at the blow" if angle_deg is None else f"{angle:g}° behind the blow"
    return (
        [(0.0, 0.0), _place(pin), _place(joint), (base, 0.0)],
        [(_place(a), _place(b)) for a, b in zip(pins, ends, strict=True)],
        position,
    )


def _place(point: Any) -> Place:
    return float(point[0]), float(point[1])


def _bar(length: float, eye: float, hole: float) -> tuple[Outline, tuple[Circle, ...]]:
    """A link along x, rounded about both joints."""
    pieces = (
        Straight((length, -eye)), Arc((length, eye), 1.0), Straight((0.0, eye)), Arc((0.0, -eye), 1.0),
    )  # fmt: skip
    return Outline((0.0, -eye), pieces), (Circle((0.0, 0.0), hole), Circle((length, 0.0), hole))


def _placed(flat: Outline, shift: Place, angle: float) -> Outline:
    """Rotate and translate an outline of lines and arcs."""
    cos, sin = math.cos(angle), math.sin(angle)

    def to(place: Place) -> Place:
        x, y = place
        return shift[0] + cos * x - sin * y, shift[1] + sin * x + cos * y

    pieces: list[Piece] = [
        Arc(to(piece.end), piece.bulge) if isinstance(piece, Arc) else Straight(to(piece.end)) for piece in flat.pieces
    ]
    return Outline(to(flat.start), tuple(pieces), flat.layer)


def _drawing(
    bars: Sequence[Outline],
    joints: Sequence[Place],
    way: Sequence[tuple[Place, Place]],
    lengths: Mapping[str, float],
    eye: float,
    hole: float,
    position: str,
) -> Drawing:
    """Front view of the assembly, with the swept outline of links and eyes dashed."""
    crank, base = lengths["crank"], lengths["base"]
    shapes: list[Outline | Circle | Line] = [*bars]
    shapes += [Circle(at, hole) for at in joints]
    shapes.append(Circle((0.0, 0.0), crank, Layer.CENTER))
    if way:
        shapes.append(Line(tuple(joint for _, joint in way), Layer.CENTER))
        pins, ends = np.array(way).transpose(1, 2, 0)
        around = outline(segments_of(pins, ends, base), eye)
        if around is not None:
            swept = [(float(x), float(y)) for x, y in around]
            shapes.append(Outline(swept[0], tuple(map(Straight, (*swept[1:], swept[0]))), Layer.HIDDEN))
    below = min(y for shape in shapes for _, y in extent(shape))
    dimensions = []
    for number, name in enumerate(LINKS):
        y = below - (1.0 + number) * (3.2 * eye + 0.06 * max(lengths.values()))
        flat, holes = _bar(lengths[name], eye, hole)
        shapes += [_placed(flat, (0.0, y), 0.0), *(Circle((c.center[0], y), c.radius) for c in holes)]
        shapes.append(Line(((-1.3 * eye, y), (lengths[name] + 1.3 * eye, y)), Layer.CENTER))
        words = words_of(name, lengths[name])
        dimensions.append(Dimension((0.0, y), (lengths[name], y), words, "x", y + 1.4 * eye, 0, f"{name}_mm"))
    outlined = "; dashed, the outline of what they sweep" if any(s.layer is Layer.HIDDEN for s in shapes) else ""
    return Drawing(
        "The four links, to scale", tuple(shapes), tuple(dimensions), (),
        f"The four links {position}{outlined}. Below, each by itself. mm, to scale.",
    )  # fmt: skip
