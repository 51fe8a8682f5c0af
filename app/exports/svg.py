"""The part's drawing as SVG in its true size: one unit is a millimetre."""

from __future__ import annotations

from app.designs.kind import Kind
from app.designs.pictures.drawing_svg import drawing_to_scale
from app.exports.export import Export, Refusal, Run, Wishes, of_a_part
from app.exports.parts import part_of


def make(kind: Kind, run: Run, wishes: Wishes) -> bytes | Refusal:
    """The drawing, printed in its true size by whatever keeps to millimetres."""
    part = part_of(kind, run, wishes)
    return part if isinstance(part, Refusal) else drawing_to_scale(part.drawing).encode()


SVG = Export("svg", "SVG: the drawing in its true size", "image/svg+xml", "svg", make, of_a_part)
