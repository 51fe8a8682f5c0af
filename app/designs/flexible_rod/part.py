"""The strip as a part, with its clamped ends indicated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.designs.drawing import Dimension, Drawing, Layer, Line, Note, Outline, Straight, rectangle, words_of
from app.designs.part import Extrusion, Parameter, Part
from solvers.materials import CATALOGUE

_CLAMPED_LENGTH = 0.14
"""Length shown of the clamped ends, in free lengths; their real length depends on the machine."""


def part(run: Mapping[str, Any], _angle_deg: float | None = None) -> Part:
    """The strip as an extrusion: x along it from the clamp, y across, z through the thickness."""
    found = run["result"]["dimensions"]
    b, h, l = (float(found[name]) for name in ("b_mm", "h_mm", "l_mm"))
    corners = ((0.0, -0.5 * b), (l, -0.5 * b), (l, 0.5 * b), (0.0, 0.5 * b))
    face = Outline(corners[0], tuple(Straight(corner) for corner in (*corners[1:], corners[0])))
    material = run["spec"].get("material") or {}
    return Part(
        title="Flexible rod",
        solids=(Extrusion("strip", face, (), -0.5 * h, h),),
        parameters=(
            Parameter("b_mm", b, "mm", "width"),
            Parameter("h_mm", h, "mm", "thickness"),
            Parameter("l_mm", l, "mm", "free length between clamp and head"),
        ),
        drawing=_drawing(face, b, h, l),
        mass_g=run["result"].get("mass_g"),
        density_kg_m3=_density(material),
        remarks=("free length; the held ends come on top",),
    )


def _density(material: Mapping[str, Any]) -> float | None:
    if material.get("name"):
        return CATALOGUE[material["name"]].density
    return material.get("density_kg_m3")


def _drawing(face: Outline, b: float, h: float, l: float) -> Drawing:
    """Front view, and below it the side view."""
    held, size = _CLAMPED_LENGTH * l, max(b, l)
    below = -0.5 * b - 0.22 * size - 0.5 * h
    edge = rectangle(0.0, below - 0.5 * h, l, below + 0.5 * h)
    shapes: list[Line | Outline] = [face, edge]
    for start, end in ((-held, 0.0), (l, l + held)):
        # open cut: the strip continues
        outer = start if end == 0.0 else end
        inner = end if end == 0.0 else start
        for middle, half in ((0.0, 0.5 * b), (below, 0.5 * h)):
            shapes += [
                Line(((inner, middle + side * half), (outer, middle + side * half)), Layer.HIDDEN) for side in (-1, 1)
            ]
    shapes += [Line(((-held, y), (l + held, y)), Layer.CENTER) for y in (0.0, below)]
    dimensions = (
        Dimension((0.0, 0.5 * b), (l, 0.5 * b), words_of("l", l), "x", 0.5 * b, 1, "l_mm"),
        Dimension((-held, -0.5 * b), (-held, 0.5 * b), words_of("b", b), "y", -held, -1, "b_mm"),
        Dimension((l + held, below - 0.5 * h), (l + held, below + 0.5 * h), words_of("h", h), "y", l + held, 1, "h_mm"),
    )
    # Below the ends, where longer words of other languages cross no line.
    under = -0.5 * b - 0.06 * size
    notes = (Note((-0.5 * held, under), "clamp"), Note((l + 0.5 * held, under), "head"))
    return Drawing(
        "The strip, to scale", tuple(shapes), dimensions, notes,
        "The free strip from its broad face and from its edge; dashed, the ends by which clamp and head hold it. "
        "mm, to scale.",
    )  # fmt: skip
