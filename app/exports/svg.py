"""SVG export of the part's drawing at true scale: one unit is a millimetre."""

from __future__ import annotations

from app.designs.kind import Kind
from app.designs.pictures.drawing_svg import drawing_to_scale
from app.exports.export import Export, ExportOptions, Refusal, Run, has_part
from app.exports.parts import part_of


def make(kind: Kind, run: Run, options: ExportOptions) -> bytes | Refusal:
    """The drawing at true scale."""
    part = part_of(kind, run, options)
    return part if isinstance(part, Refusal) else drawing_to_scale(part.drawing).encode()


SVG = Export("svg", "SVG: the drawing in its true size", "image/svg+xml", "svg", make, has_part)
