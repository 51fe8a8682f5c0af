"""STEP export of the part: named solids in millimetres, made with OpenCASCADE through build123d."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from app.designs.drawing import Arc, Bezier, Outline, extent, middle_of
from app.designs.kind import Kind
from app.designs.part import Extrusion, Part, Revolution, Solid
from app.exports.export import Export, ExportOptions, ExportProcess, Refusal, Run, has_part

if TYPE_CHECKING:
    import build123d

_MIN_MM, _MAX_MM = 1e-5, 1e6
"""The modeller merges points closer than 1e-7 mm."""


def make(kind: Kind, run: Run, options: ExportOptions) -> bytes | Refusal:
    """The STEP file, or a refusal if the sizes are out of the modeller's range."""
    part = kind.part(run, options.angle_deg)
    sizes = [size for solid in part.solids for size in _sizes(solid)]
    if min(sizes) < _MIN_MM or max(sizes) > _MAX_MM:
        allowed = f"sizes from {_MIN_MM:g} to {_MAX_MM:g} mm"
        return Refusal("", "the part has sizes that a solid model cannot hold", allowed)
    return step_file(part, str(run["created_at"])[:19])


def _sizes(solid: Solid) -> tuple[float, ...]:
    outline = solid.outline if isinstance(solid, Extrusion) else solid.profile
    xs, ys = zip(*extent(outline), strict=True)
    sides = max(xs) - min(xs), max(ys) - min(ys)
    return (*sides, solid.height) if isinstance(solid, Extrusion) else sides


def step_file(part: Part, when: str) -> bytes:
    """Write the part; ``when`` replaces the time of writing, so that a run always yields the same file."""
    import build123d as b

    solids = [model_solid(solid) for solid in part.solids]
    for shape, solid in zip(solids, part.solids, strict=True):
        shape.label = solid.name
    whole = solids[0] if len(solids) == 1 else b.Compound(children=solids, label=part.title)
    out = io.BytesIO()
    if not b.export_step(whole, out, unit=b.Unit.MM, timestamp=when):
        raise RuntimeError("the STEP file could not be written")
    return out.getvalue()


def model_solid(solid: Solid) -> build123d.Solid:
    """Model one solid."""
    import build123d as b

    if isinstance(solid, Revolution):
        face = b.Face(_wire(solid.profile))
        return b.Solid.revolve(face, 360.0, b.Axis.X)
    holes = [b.Wire.make_circle(hole.radius, b.Plane((*hole.center, 0.0))) for hole in solid.holes]
    face = b.Face(_wire(solid.outline), holes)
    body = b.Solid.extrude(face, b.Vector(0.0, 0.0, solid.height))
    place = b.Location((*solid.shift, solid.bottom), (0.0, 0.0, solid.turn_deg))
    return body.moved(place)


def _wire(outline: Outline) -> build123d.Wire:
    import build123d as b

    edges, here = [], outline.start
    for piece in outline.pieces:
        if isinstance(piece, Bezier):
            edges.append(b.Edge.make_bezier(here, piece.first, piece.second, piece.end))
        elif isinstance(piece, Arc):
            edges.append(b.Edge.make_three_point_arc(here, middle_of(here, piece), piece.end))
        elif here != piece.end:
            edges.append(b.Edge.make_line(here, piece.end))
        here = piece.end
    return b.Wire(edges)


STEP = Export(
    "step", "STEP: the solid", "model/step", "step", make, has_part, where=ExportProcess.SOLIDS,
    module="build123d", extra="cad",
)  # fmt: skip
