"""SVG export of the part's drawing at true scale: one unit is a millimetre."""

from __future__ import annotations

from app.designs.kind import Kind
from app.designs.pictures.drawing_svg import drawing_to_scale
from app.exports.export import Export, ExportOptions, Run, has_part


def make(kind: Kind, run: Run, options: ExportOptions) -> bytes:
    """The drawing at true scale."""
    return drawing_to_scale(kind.part(run, options.angle_deg).drawing).encode()


SVG = Export("svg", "SVG: the drawing in its true size", "image/svg+xml", "svg", make, has_part)
