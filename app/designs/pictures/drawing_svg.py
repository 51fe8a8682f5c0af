"""Drawings as SVG: to scale, dimensioned, each dimension marked with its field."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from html import escape
from zlib import crc32

from app.designs.drawing import (
    Arc,
    Bezier,
    Circle,
    Dimension,
    Drawing,
    Layer,
    Line,
    Note,
    Outline,
    Place,
    Shape,
    extent,
)
from app.designs.pictures.chart import STYLE

WIDTH, HEIGHT = 430.0, 360.0
_STEP, _GAP, _ARROW, _LETTER, _CAP = 25.0, 4.0, 7.0, 7.6, 10.0
_COLUMN = 2.0 * (5.0 + _CAP) + 5.0
"""From one vertical dimension line to the next: the text of each may stand between them."""
_ROOM = 14.0
_STYLES = {
    Layer.OUTLINE: 'fill="none" stroke="currentColor" stroke-width="2"',
    Layer.SECTION: 'fill="url(#HATCH)" stroke="currentColor" stroke-width="2"',
    Layer.HIDDEN: 'fill="none" stroke="currentColor" stroke-width="1.3" stroke-dasharray="6 4"',
    Layer.CENTER: 'fill="none" stroke="currentColor" stroke-opacity="0.5" stroke-dasharray="14 3 3 3"',
    Layer.CONTEXT: 'fill="currentColor" fill-opacity="0.06" stroke="currentColor" stroke-opacity="0.45"',
}
_STROKES = re.compile(r'(stroke-(?:width|dasharray)=")([^"]*)"')
_HATCH = (
    '<defs><pattern id="HATCH" width="7" height="7" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">'
    '<line x1="0" y1="0" x2="0" y2="7" stroke="currentColor" stroke-opacity="0.45"/></pattern></defs>'
)


class _Sheet:
    """Mapping from millimetres to the picture, and the used area."""

    def __init__(self, drawing: Drawing) -> None:
        xs, ys = zip(*(place for shape in drawing.shapes for place in extent(shape)), strict=True)
        wide, high = max(max(xs) - min(xs), 1e-9), max(max(ys) - min(ys), 1e-9)
        self.scale = min(WIDTH / wide, HEIGHT / high)
        self._left, self._top = min(xs), max(ys)
        self.box = [0.0, 0.0, wide * self.scale, high * self.scale]

    def __call__(self, place: Place) -> Place:
        return self.x(place[0]), self.y(place[1])

    def x(self, value: float) -> float:
        return (value - self._left) * self.scale

    def y(self, value: float) -> float:
        return (self._top - value) * self.scale

    def use(self, x: float, y: float) -> None:
        left, top, right, bottom = self.box
        self.box = [min(left, x), min(top, y), max(right, x), max(bottom, y)]


def drawing_svg(drawing: Drawing) -> str:
    """The drawing as SVG in the colour of the surrounding text, cropped to its content."""
    sheet = _Sheet(drawing)
    body = [_shape(sheet, shape) for shape in drawing.shapes]
    body += [_note(sheet, note) for note in drawing.notes]
    body += [_dimension(sheet, dimension) for dimension in drawing.dimensions]
    left, top, right, bottom = sheet.box
    view = f"{left - _ROOM:.0f} {top - _ROOM:.0f} {right - left + 2 * _ROOM:.0f} {bottom - top + 2 * _ROOM:.0f}"
    out = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{view}" role="img" class="drawing" '
        f'font-family="system-ui, sans-serif" font-size="14"><title>{escape(drawing.title)}</title>{_HATCH}'
        + "".join(body)
        + "</svg>"
    )
    # Ids must be unique on a page with several drawings.
    return out.replace("HATCH", f"hatch-{crc32(out.encode()):08x}")


def drawing_alone(drawing: Drawing) -> str:
    """The drawing as a stand-alone SVG with its own colours."""
    return drawing_svg(drawing).replace("</title>", f"</title>{STYLE}", 1)


def drawing_to_scale(drawing: Drawing) -> str:
    """The drawing as SVG at true scale: one unit is a millimetre, coordinates with nine digits.

    Text and dimensions keep their size relative to the drawing on a page.
    """
    sheet = _Sheet(drawing)
    marks = [_note(sheet, note) for note in drawing.notes]
    marks += [_dimension(sheet, dimension) for dimension in drawing.dimensions]
    scale = sheet.scale
    left, top, right, bottom = (value / scale for value in sheet.box)
    room = _ROOM / scale
    wide, high = right - left + 2.0 * room, bottom - top + 2.0 * room

    def place(point: Place) -> Place:
        x, y = sheet(point)
        return x / scale, y / scale

    shapes = []
    for shape in drawing.shapes:
        style = _STYLES[shape.layer]
        if shape.layer is Layer.CONTEXT:
            style = style.replace('fill="currentColor"', 'fill="none"')
        data = path_of(_as_path(shape), place, 1.0, ".9g")
        shapes.append(f'<path d="{data}" {_in_millimetres(style, scale)}/>')
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.9g}mm" height="{high:.9g}mm" '
        f'viewBox="{left - room:.9g} {top - room:.9g} {wide:.9g} {high:.9g}" color="black">'
        f"<title>{escape(drawing.title)}</title>"
        + _HATCH.replace("rotate(45)", f"scale({1.0 / scale:.9g}) rotate(45)")
        + f'<g id="part">{"".join(shapes)}</g>'
        + f'<g id="marks" transform="scale({1.0 / scale:.9g})" font-family="sans-serif" font-size="14">'
        + "".join(marks)
        + "</g></svg>\n"
    )


def _in_millimetres(style: str, scale: float) -> str:
    """Convert stroke widths and dash lengths from page units to drawing units."""
    style = style if "stroke-width" in style else f'{style} stroke-width="1"'
    return _STROKES.sub(
        lambda found: found[1] + " ".join(f"{float(n) / scale:.6g}" for n in found[2].split()) + '"', style
    )


def _as_path(shape: Shape) -> Line | Outline:
    """A circle as two arcs, so that all shapes are paths."""
    if not isinstance(shape, Circle):
        return shape
    (x, y), r = shape.center, shape.radius
    return Outline((x - r, y), (Arc((x + r, y), 1.0), Arc((x - r, y), 1.0)), shape.layer)


def _shape(sheet: _Sheet, shape: Shape) -> str:
    style = _STYLES[shape.layer]
    if isinstance(shape, Circle):
        x, y = sheet(shape.center)
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{shape.radius * sheet.scale:.1f}" {style}/>'
    if not shape.closed and shape.layer is Layer.CONTEXT:
        style = style.replace('fill="currentColor"', 'fill="none"')
    return f'<path d="{path_of(shape, sheet, sheet.scale, ".1f")}" {style}/>'


def path_of(shape: Line | Outline, to: Callable[[Place], Place], scale: float, digits: str) -> str:
    """SVG path data of a shape, with points mapped by ``to``, y pointing down."""

    def at(*places: Place) -> str:
        return " ".join(f"{x:{digits}},{y:{digits}}" for x, y in map(to, places))

    end = "Z" if shape.closed else ""
    if isinstance(shape, Line):
        return f"M{'L'.join(at(place) for place in shape.points)}{end}"
    commands, here = [f"M{at(shape.start)}"], shape.start
    for piece in shape.pieces:
        if isinstance(piece, Arc):
            chord = math.dist(here, piece.end)
            radius = f"{0.25 * chord * (piece.bulge + 1.0 / piece.bulge) * scale:{digits}}".lstrip("-")
            commands.append(
                f"A{radius} {radius} 0 {int(abs(piece.bulge) > 1.0)} {int(piece.bulge < 0.0)} {at(piece.end)}"
            )
        elif isinstance(piece, Bezier):
            commands.append(f"C{at(piece.first, piece.second, piece.end)}")
        else:
            commands.append(f"L{at(piece.end)}")
        here = piece.end
    return "".join(commands) + end


def _note(sheet: _Sheet, note: Note) -> str:
    x, y = sheet(note.at)
    half = 0.5 * _LETTER * len(note.words)
    sheet.use(x - half, y)
    sheet.use(x + half, y)
    return _words(x, y + 4.0, note.words, "middle")


def _dimension(sheet: _Sheet, dimension: Dimension) -> str:
    (x1, y1), (x2, y2) = sheet(dimension.start), sheet(dimension.end)
    if dimension.axis == "x":
        y = sheet.y(dimension.at) - dimension.level * _STEP
        ends, extensions = ((x1, y), (x2, y)), (((x1, y1), (x1, y)), ((x2, y2), (x2, y)))
    elif dimension.axis == "y":
        x = sheet.x(dimension.at) + _beside(dimension.level)
        ends, extensions = ((x, y1), (x, y2)), (((x1, y1), (x, y1)), ((x2, y2), (x, y2)))
    else:
        ends, extensions = ((x1, y1), (x2, y2)), ()
    field = f' data-for="{escape(dimension.path)}"' if dimension.path else ""
    lines = "".join(_extension(*pair) for pair in extensions) + _arrows(sheet, *ends)
    return f'<g class="dimension"{field}>{lines}{_measure(sheet, *ends, dimension)}</g>'


def _beside(level: int) -> float:
    """The distance of a vertical dimension line from what it is level with."""
    return math.copysign(_STEP + _COLUMN * (abs(level) - 1), level) if level else 0.0


def _extension(start: Place, end: Place) -> str:
    """Extension lines, from the part to slightly beyond the dimension line."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    size = math.hypot(dx, dy)
    if size < 1.0:
        return ""
    x, y = end[0] + _GAP * dx / size, end[1] + _GAP * dy / size
    return _stroke(start, (x, y), 'stroke-opacity="0.45" stroke-width="0.8"')


def _arrows(sheet: _Sheet, start: Place, end: Place) -> str:
    """The dimension line with arrows, placed outside if there is no room."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    size = math.hypot(dx, dy)
    if size < 0.5:
        return ""
    ux, uy = dx / size, dy / size
    if size < 3.0 * _ARROW:
        ux, uy = -ux, -uy
        start_tail = (start[0] + 2.0 * _ARROW * ux, start[1] + 2.0 * _ARROW * uy)
        end_tail = (end[0] - 2.0 * _ARROW * ux, end[1] - 2.0 * _ARROW * uy)
        line = _stroke(start_tail, start) + _stroke(end, end_tail)
    else:
        line = _stroke(start, end)
    for x, y in (start, end):
        sheet.use(x - _ARROW, y - _ARROW)
        sheet.use(x + _ARROW, y + _ARROW)
    return line + _head(start, ux, uy) + _head(end, -ux, -uy)


def _head(tip: Place, ux: float, uy: float) -> str:
    x, y = tip[0] + _ARROW * ux, tip[1] + _ARROW * uy
    across = 0.32 * _ARROW
    corners = (tip, (x - across * uy, y + across * ux), (x + across * uy, y - across * ux))
    points = " ".join(f"{px:.1f},{py:.1f}" for px, py in corners)
    return f'<polygon points="{points}" fill="currentColor"/>'


def _measure(sheet: _Sheet, start: Place, end: Place, dimension: Dimension) -> str:
    """The text along the line, or beside it if it is too long."""
    words, size = dimension.words, math.hypot(end[0] - start[0], end[1] - start[1])
    x, y = 0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])
    long = _LETTER * len(words)
    if long + 4.0 > size:
        if dimension.axis != "y":
            x = max(start[0], end[0]) + (2.0 * _ARROW if size < 3.0 * _ARROW else 0.0) + 5.0
            sheet.use(x + long, y)
            return _words(x, y + 4.0, words, "start")
        if dimension.level == 0:
            return _inside_part(sheet, (x, y), size, words)
        # On the side away from the part, where neither its outline nor the extension lines are.
        x += 5.0 + _CAP if dimension.level > 0 else -5.0
        sheet.use(x - _CAP, y - 0.5 * long)
        sheet.use(x, y + 0.5 * long)
        return _words(x, y, words, "middle", _turned(-90.0, x, y))
    turn = math.degrees(math.atan2(end[1] - start[1], end[0] - start[0]))
    turn = turn - 180.0 if turn > 90.0 else turn + 180.0 if turn <= -90.0 else turn
    turn = -90.0 if abs(turn) == 90.0 else turn
    angle = math.radians(turn)
    x, y = x + 5.0 * math.sin(angle), y - 5.0 * math.cos(angle)
    sheet.use(x - 12.0 * abs(math.sin(angle)), y - 14.0 * math.cos(angle))
    return _words(x, y, words, "middle", _turned(turn, x, y))


def _inside_part(sheet: _Sheet, middle: Place, size: float, words: str) -> str:
    """The text of a vertical line within the part: beside its upper half, above the centre line, or beyond the upper
    arrow where there is no room between the two."""
    (x, y), half = middle, 0.5 * size
    long = _LETTER * len(words)
    if half > 4.0 + 1.5 * _CAP:
        return _words(x + 5.0, y - 4.0, words, "start")
    y -= half + 2.0 * _ARROW + 4.0
    sheet.use(x - 0.5 * long, y - 12.0)
    sheet.use(x + 0.5 * long, y)
    return _words(x, y, words, "middle")


def _turned(turn: float, x: float, y: float) -> str:
    """The attribute that turns a text by ``turn`` [°] about its place."""
    return f' transform="rotate({turn:.1f} {x:.1f} {y:.1f})"' if abs(turn) > 0.05 else ""


def _words(x: float, y: float, words: str, anchor: str, more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="currentColor"{more}>{escape(words)}</text>'


def _stroke(start: Place, end: Place, style: str = 'stroke-width="1"') -> str:
    (x1, y1), (x2, y2) = start, end
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="currentColor" {style}/>'
