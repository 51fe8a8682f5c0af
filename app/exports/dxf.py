"""DXF R2010 export of the part's drawing: millimetres, 1:1, dimensioned, with a title block."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any

from app.designs.drawing import Arc, Bezier, Circle, Dimension, Layer, Line, Note, Outline, Place, Shape, extent
from app.designs.kind import Kind
from app.exports.export import Export, ExportOptions, Run, has_part
from app.exports.title import title_rows

if TYPE_CHECKING:
    from ezdxf.layouts import Modelspace

LAYERS = {"OUTLINE": (7, "CONTINUOUS", 50), "CENTER": (1, "CENTER", 18), "DIMENSIONS": (3, "CONTINUOUS", 18),
          "HIDDEN": (8, "DASHED", 25), "TITLE": (7, "CONTINUOUS", 25)}  # fmt: skip
"""Color, line type, line weight [0.01 mm]."""
_ON = {
    Layer.OUTLINE: "OUTLINE",
    Layer.SECTION: "OUTLINE",
    Layer.CENTER: "CENTER",
    Layer.HIDDEN: "HIDDEN",
    Layer.CONTEXT: "HIDDEN",
}
_LETTER = 0.022
"""Text height as a fraction of the drawing's greatest extent."""


def make(kind: Kind, run: Run, options: ExportOptions) -> bytes:
    """The drawing, with associative dimensions."""
    part = kind.part(run, options.angle_deg)
    import ezdxf
    from ezdxf import units

    document = ezdxf.new("R2010", setup=["linetypes"])
    document.header["$INSUNITS"] = units.MM
    document.header["$MEASUREMENT"] = 1
    for name, (color, linetype, weight) in LAYERS.items():
        document.layers.add(name, color=color, linetype=linetype, lineweight=weight)
    space = document.modelspace()
    drawing = part.drawing
    xs, ys = zip(*(place for shape in drawing.shapes for place in extent(shape)), strict=True)
    size = max(max(xs) - min(xs), max(ys) - min(ys))
    text_height = _LETTER * size
    document.header["$LTSCALE"] = size / 120.0
    style = _dimension_style(document, text_height)
    for shape in drawing.shapes:
        _add(space, shape)
    for note in drawing.notes:
        _note(space, note, text_height)
    for dimension in drawing.dimensions:
        _measure(space, dimension, text_height, style)
    lowest = min([min(ys), *(_line_of(d, text_height)[1] for d in drawing.dimensions if d.axis == "x")])
    corners = _title(space, title_rows(run, part), (min(xs), lowest - 4.0 * text_height), text_height)
    document.header["$EXTMIN"] = (min(xs), corners[0][1], 0.0)
    document.header["$EXTMAX"] = (max(max(xs), corners[1][0]), max(ys), 0.0)
    out = io.StringIO()
    document.write(out)
    return document.encode(out.getvalue())


def _add(space: Modelspace, shape: Shape) -> None:
    attributes = {"layer": _ON[shape.layer]}
    if isinstance(shape, Circle):
        space.add_circle(shape.center, shape.radius, attributes)
    elif isinstance(shape, Line):
        space.add_lwpolyline(shape.points, close=shape.closed, dxfattribs=attributes)
    else:
        _outline(space, shape, attributes)


def _outline(space: Modelspace, shape: Outline, attributes: dict[str, Any]) -> None:
    """Lines and arcs as polylines, Bézier curves as splines between them."""
    run: list[tuple[float, float, float]] = []
    here = shape.start
    whole = not any(isinstance(piece, Bezier) for piece in shape.pieces)

    def flush(last: Place) -> None:
        if run:
            space.add_lwpolyline([*run, (*last, 0.0)], format="xyb", dxfattribs=attributes)
            run.clear()

    for piece in shape.pieces:
        if isinstance(piece, Bezier):
            flush(here)
            points = [(x, y, 0.0) for x, y in (here, piece.first, piece.second, piece.end)]
            space.add_open_spline(points, degree=3, dxfattribs=attributes)
        else:
            run.append((*here, piece.bulge if isinstance(piece, Arc) else 0.0))
        here = piece.end
    if whole and shape.closed:
        space.add_lwpolyline(run, format="xyb", close=True, dxfattribs=attributes)
    else:
        flush(here)


def _dimension_style(document: Any, text_height: float) -> str:
    style = document.dimstyles.duplicate_entry("Standard", "CRANKWRIGHT")
    style.dxf.dimtxt, style.dxf.dimasz, style.dxf.dimgap = text_height, 0.8 * text_height, 0.4 * text_height
    style.dxf.dimexe, style.dxf.dimexo = 0.5 * text_height, 0.25 * text_height
    style.dxf.dimscale, style.dxf.dimtad, style.dxf.dimtih, style.dxf.dimtoh = 1.0, 1, 0, 0
    style.dxf.dimlunit, style.dxf.dimdsep, style.dxf.dimzin = 2, ord("."), 8
    style.dxf.dimdec = min(8, max(2, 4 - math.floor(math.log10(text_height / _LETTER))))
    return "CRANKWRIGHT"


def _line_of(dimension: Dimension, text_height: float) -> Place:
    """A point on the dimension line."""
    away = dimension.at + 3.0 * text_height * dimension.level
    return (dimension.start[0], away) if dimension.axis == "x" else (away, dimension.start[1])


def _measure(space: Modelspace, dimension: Dimension, text_height: float, style: str) -> None:
    symbol = dimension.words.rpartition(" ")[0]
    text = f"{symbol} <>" if symbol else "<>"
    attributes = {"layer": "DIMENSIONS"}
    if dimension.axis == "free":
        made = space.add_aligned_dim(dimension.start, dimension.end, 0.0, text, style, dxfattribs=attributes)
    else:
        angle = 0.0 if dimension.axis == "x" else 90.0
        base = _line_of(dimension, text_height)
        made = space.add_linear_dim(
            base, dimension.start, dimension.end, angle=angle, text=text, dimstyle=style, dxfattribs=attributes
        )
    made.render()


def _note(space: Modelspace, note: Note, text_height: float) -> None:
    from ezdxf.enums import TextEntityAlignment

    text = space.add_text(_escaped(note.words), height=text_height, dxfattribs={"layer": "TITLE"})
    text.set_placement(note.at, align=TextEntityAlignment.MIDDLE_CENTER)


def _title(space: Modelspace, rows: list[tuple[str, str]], corner: Place, text_height: float) -> tuple[Place, Place]:
    """Add the title block below the drawing; returns its lower-left and upper-right corners."""
    left, top = corner
    step, wide = 2.0 * text_height, 14.0 * text_height + 0.75 * text_height * max(len(value) for _, value in rows)
    for number, (name, value) in enumerate(rows):
        y = top - (number + 0.7) * step
        for x, words in ((left + text_height, name), (left + 12.0 * text_height, value)):
            text = space.add_text(_escaped(words), height=text_height, dxfattribs={"layer": "TITLE"})
            text.set_placement((x, y))
    bottom = top - len(rows) * step - 0.3 * text_height
    frame = [(left, top), (left + wide, top), (left + wide, bottom), (left, bottom)]
    space.add_lwpolyline(frame, close=True, dxfattribs={"layer": "TITLE"})
    return (left, bottom), (left + wide, top)


def _escaped(text: str) -> str:
    """Escape the format's control codes: a caret before a text_height, a double per cent sign, a backslash."""
    return text.replace("^", "^ ").replace("%%", "% %").replace("\\", "/")


DXF = Export("dxf", "DXF: the dimensioned drawing, true size", "image/vnd.dxf", "dxf", make, has_part, module="ezdxf")
