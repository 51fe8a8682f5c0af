"""The pin or bushing as a turned part: bore and outer contour along its axis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from app.designs.drawing import Bezier, Dimension, Drawing, Layer, Line, Outline, Piece, Place, Straight, words_of
from app.designs.part import Parameter, Part, Revolution
from app.designs.pin_profile.request import material_of
from solvers.numerics.cubics import Cubic

_LENGTH_TOLERANCE = 1e-9
"""Relative length difference below manufacturing resolution."""
_MAX_NAMED_CORNERS = 24
"""Maximum number of corners exported as parameters; a profile with more is a curve."""


class Span(Cubic):
    """A diameter over an interval, in mm."""

    @property
    def straight(self) -> bool:
        rise = self.last - self.first
        off = max(abs(slope * (self.end - self.start) - rise) for slope in (self.slope_first, self.slope_last))
        return off <= _LENGTH_TOLERANCE * max(self.first, self.last)

    def reversed(self) -> Span:
        """The span in reverse direction."""
        return Span(self.end, self.start, self.last, self.first, self.slope_last, self.slope_first)


def has_wall(result: Mapping[str, Any]) -> bool:
    """Whether the part has a wall everywhere; a batch item may be stored without its profile."""
    return (result.get("least_wall_mm") or 0.0) > 0.0


def part(run: Mapping[str, Any], _angle_deg: float | None = None) -> Part:
    """The part of a stored result: a solid of revolution about x, which runs along the pin."""
    result, spec = run["result"], run["spec"]
    g, bushing = spec["geometry"], spec["variable"] == "outer"
    bore, outside = walls(run)
    length = bore[-1].end
    drills = () if bushing else tuple(_drills(bore, length))
    return Part(
        title="Bushing" if bushing else "Piston pin",
        solids=(Revolution("bushing" if bushing else "pin", section(bore, outside, length)),),
        parameters=tuple(_parameters(g, length, bore, outside, bushing, drills)),
        drawing=_drawing(bore, outside, length, bushing, drills),
        mass_g=result["mass_g"],
        density_kg_m3=material_of(spec).density,
        remarks=tuple(_remarks(drills)),
    )


def walls(run: Mapping[str, Any]) -> tuple[list[Span], list[Span]]:
    """Bore and outer contour of a run with a result."""
    result, spec = run["result"], run["spec"]
    g, bushing = spec["geometry"], spec["variable"] == "outer"
    length = 2.0 * (g["boss_length_mm"] + g["gap_mm"]) + g["small_end_length_mm"]
    found = _found(result, spec, length, bushing)
    even = all_along(result["min_bore_mm"] if bushing else result["outer_max_mm"], length)
    return (even, found) if bushing else (found, even)


def all_along(diameter: float, length: float) -> list[Span]:
    """A constant diameter."""
    return [Span(0.0, length, diameter, diameter, 0.0, 0.0)]


def _found(result: Mapping[str, Any], spec: Mapping[str, Any], length: float, bushing: bool) -> list[Span]:
    """The varying diameter along the whole part, in order."""
    name = "outer_diameter_mm" if bushing else "bore_mm"
    if result.get("contour"):
        keys = ("x_from_mm", "x_to_mm", "diameter_from_mm", "diameter_to_mm", "slope_from", "slope_to")
        return _merged([Span(*(float(piece[key]) for key in keys)) for piece in result["contour"]])
    points = result.get("corners") or spec.get("profile")
    if points is None:
        plain = spec["geometry"]["outer_diameter_mm"] if bushing else spec.get("bore_mm")
        # a design of an early version: its table, interpolated linearly
        points = result["profile"] if plain is None or "form" in spec else [{"x_mm": 0.0, name: plain}]
    return _merged(straight_between([(float(p["x_mm"]), float(p[name])) for p in points], length))


def straight_between(points: list[Place], length: float) -> list[Span]:
    """Linear interpolation of points; half a pin is mirrored, and the ends are extended."""
    if points[-1][0] <= 0.5 * length * (1.0 + 1e-12):
        points = points + [(length - x, d) for x, d in reversed(points)]
    points = [(0.0, points[0][1]), *((min(x, length), d) for x, d in points), (length, points[-1][1])]
    return [
        Span(a, b, first, last, (last - first) / (b - a), (last - first) / (b - a))
        for (a, first), (b, last) in pairwise(points)
        if b - a > _LENGTH_TOLERANCE * length
    ]


def _merged(spans: Sequence[Span]) -> list[Span]:
    """Merge collinear straight spans, so that one cylinder is one face."""
    found: list[Span] = []
    for span in spans:
        before = found[-1] if found else None
        if before and before.straight and span.straight:
            rise = (span.last - before.first) / (span.end - before.start)
            meets = before.first + rise * (before.end - before.start)
            near = _LENGTH_TOLERANCE * max(before.first, before.last, span.last)
            if abs(before.last - meets) <= near and abs(span.first - meets) <= near:
                found[-1] = Span(before.start, span.end, before.first, span.last, rise, rise)
                continue
        found.append(span)
    return found


def _pieces(spans: Sequence[Span], start: Place, sign: float = 1.0) -> Iterator[Piece]:
    """The spans as outline segments in radii from ``start`` on, with steps between them."""
    here = start
    for span in spans:
        first, last = (span.start, 0.5 * sign * span.first), (span.end, 0.5 * sign * span.last)
        if abs(here[1] - first[1]) > _LENGTH_TOLERANCE * max(abs(here[1]), abs(first[1])):
            yield Straight(first)
        if span.straight:
            yield Straight(last)
        else:
            third = (span.end - span.start) / 3.0
            inner = 0.5 * max(0.0, span.first + span.slope_first * third)
            outer = 0.5 * max(0.0, span.last - span.slope_last * third)
            yield Bezier((span.start + third, sign * inner), (span.end - third, sign * outer), last)
        here = last


def section(bore: Sequence[Span], outside: Sequence[Span], length: float, sign: float = 1.0) -> Outline:
    """One section face: along the bore, up, back along the outer contour."""
    start = (0.0, 0.5 * sign * bore[0].first)
    back = [span.reversed() for span in reversed(outside)]
    corner = (length, 0.5 * sign * back[0].first)
    pieces = [*_pieces(bore, start, sign), Straight(corner), *_pieces(back, corner, sign), Straight(start)]
    return Outline(start, tuple(pieces), Layer.SECTION)


@dataclass(frozen=True)
class Drill:
    """A cylindrical bore to a depth from each end."""

    diameter: float
    depth: float
    through: bool


def _drills(bore: Sequence[Span], length: float) -> Iterator[Drill]:
    """Drills from the narrowest, which passes through; none for a bore that cannot be drilled."""
    half = [span for span in bore if span.start < 0.5 * length * (1.0 - _LENGTH_TOLERANCE)]
    mirrored = [(length - span.end, length - span.start, span.first) for span in reversed(bore)]
    same = all(
        abs(a - span.start) <= 1e-6 * length and abs(d - span.first) <= 1e-6 * span.first
        for (a, _, d), span in zip(mirrored, bore, strict=True)
    )
    plain = all(abs(span.last - span.first) <= _LENGTH_TOLERANCE * span.first and span.straight for span in bore)
    falling = all(a.first > b.first for a, b in pairwise(half))
    if not (plain and same and falling and half[-1].first > 0.0):
        return
    for number, span in enumerate(reversed(half)):
        yield Drill(span.first, length if number == 0 else span.end, number == 0)


def _remarks(drills: Sequence[Drill]) -> Iterator[str]:
    if len(drills) > 1:
        yield "; ".join(
            words_of("ø", drill.diameter) + (" through" if drill.through else f" to {drill.depth:.5g} from each end")
            for drill in drills
        )


def _parameters(
    g: Mapping[str, Any],
    length: float,
    bore: Sequence[Span],
    outside: Sequence[Span],
    bushing: bool,
    drills: Sequence[Drill],
) -> Iterator[Parameter]:
    yield Parameter("length_mm", round(length, 9), "mm", "of the whole part: bosses, gaps and small end")
    yield Parameter("boss_length_mm", g["boss_length_mm"], "mm", "in each boss of the piston")
    yield Parameter("small_end_length_mm", g["small_end_length_mm"], "mm", "in the rod's small end")
    yield Parameter("gap_mm", g["gap_mm"], "mm", "between small end and boss")
    (even, name), (varied, other) = ((bore, "bore_mm"), (outside, "outer_diameter_mm"))[:: 1 if bushing else -1]
    yield Parameter(name, even[0].first, "mm", "all along")
    if len(varied) == 1 and varied[0].first == varied[0].last:
        yield Parameter(other, varied[0].first, "mm", "all along")
        return
    sizes = [d for _, d in _ends(varied)]
    middle = next(span for span in varied if span.end >= 0.5 * length * (1.0 - _LENGTH_TOLERANCE))
    word = "outer" if bushing else "bore"
    yield Parameter(f"{word}_end_mm", varied[0].first, "mm", "diameter at the end")
    yield Parameter(f"{word}_mid_mm", middle.at(0.5 * length), "mm", "diameter in the middle")
    yield Parameter(f"min_{word}_mm", min(sizes), "mm", "least diameter")
    yield Parameter(f"max_{word}_mm", max(sizes), "mm", "greatest diameter")
    for number, drill in enumerate(drills, start=1):
        yield Parameter(f"drill_{number}_diameter_mm", drill.diameter, "mm", "through" if drill.through else "")
        yield Parameter(f"drill_{number}_depth_mm", drill.depth, "mm", "through" if drill.through else "from each end")
    if all(span.straight for span in varied) and len(varied) <= _MAX_NAMED_CORNERS:
        for number, span in enumerate(varied, start=1):
            yield Parameter(f"{word}_{number}_from_mm", span.start, "mm", "place along the axis")
            yield Parameter(f"{word}_{number}_to_mm", span.end, "mm", "place along the axis")
            yield Parameter(f"{word}_{number}_first_mm", span.first, "mm", "diameter there")
            yield Parameter(f"{word}_{number}_last_mm", span.last, "mm", "diameter there")


def _ends(spans: Sequence[Span]) -> Iterator[Place]:
    """Place and diameter of both ends of each span."""
    for span in spans:
        yield span.start, span.first
        yield span.end, span.last


def _corners(varied: Sequence[Span], length: float, D: float) -> list[Dimension]:
    """Where steps and cones end in the first half, measured from the end of the part; none for a curve."""
    if not all(span.straight for span in varied) or len(varied) > _MAX_NAMED_CORNERS:
        return []
    found = []
    for level, span in enumerate([s for s in varied if s.end < 0.5 * length * (1.0 - _LENGTH_TOLERANCE)], start=1):
        even = abs(span.last - span.first) <= _LENGTH_TOLERANCE * span.first
        words = f"{words_of('ø', span.first)} × {span.end:.5g}" if even else words_of("", span.end)
        edges = (0.0, -0.5 * D), (span.end, -0.5 * D)
        found.append(Dimension(*edges, words, "x", -0.5 * D, -level, f"corner_{level}"))
    return found


def _drawing(
    bore: Sequence[Span], outside: Sequence[Span], length: float, bushing: bool, drills: Sequence[Drill]
) -> Drawing:
    """The axial section with both faces and the bore's ends."""
    D = max(d for span in outside for d in (span.first, span.last))
    shapes: list[Outline | Line] = [section(bore, outside, length, sign) for sign in (1.0, -1.0)]
    shapes += [
        Line(((x, -0.5 * d), (x, 0.5 * d))) for x, d in ((0.0, bore[0].first), (length, bore[-1].last)) if d > 0.0
    ]
    steps = [
        (b.start, max(a.last, b.first))
        for a, b in pairwise(bore)
        if abs(a.last - b.first) > _LENGTH_TOLERANCE * max(a.last, b.first)
    ]
    shapes += [Line(((x, -0.5 * d), (x, 0.5 * d))) for x, d in steps]
    shapes.append(Line(((-0.05 * length, 0.0), (1.05 * length, 0.0)), Layer.CENTER))
    dimensions = [Dimension((0.0, 0.5 * D), (length, 0.5 * D), words_of("", length), "x", 0.5 * D, 1, "length_mm")]
    left, right = outside[0].first, bore[-1].last
    dimensions.append(
        Dimension((0.0, -0.5 * left), (0.0, 0.5 * left), words_of("ø", left), "y", 0.0, -1, "outer_diameter_mm")
    )
    if right > 0.0:
        dimensions.append(
            Dimension((length, -0.5 * right), (length, 0.5 * right), words_of("ø", right), "y", length, 1, "bore_mm")
        )
    varied = outside if bushing else bore
    if len(varied) > 1 or varied[0].first != varied[0].last:
        span = next(span for span in varied if span.end >= 0.5 * length * (1.0 - _LENGTH_TOLERANCE))
        middle = span.at(0.5 * length)
        if middle > 0.0:
            x = 0.5 * length
            edges = (x, -0.5 * middle), (x, 0.5 * middle)
            at, level = (length, 2) if bushing else (x, 0)
            dimensions.append(Dimension(*edges, words_of("ø", middle), "y", at, level, "mid"))
    for level, drill in enumerate([drill for drill in drills if not drill.through], start=1):
        edges = (0.0, -0.5 * D), (drill.depth, -0.5 * D)
        words = f"{words_of('ø', drill.diameter)} × {drill.depth:.5g}"
        dimensions.append(Dimension(*edges, words, "x", -0.5 * D, -level, f"drill_{level}"))
    if not drills:
        dimensions += _corners(varied, length, D)
    x, greatest = max(_ends(varied), key=lambda end: end[1])
    if words_of("ø", greatest) not in {each.words.partition(" × ")[0] for each in dimensions} and greatest > 0.0:
        edges = (x, -0.5 * greatest), (x, 0.5 * greatest)
        at, level = (0.0, -2) if bushing else (x, 0)
        dimensions.append(Dimension(*edges, words_of("ø", greatest), "y", at, level, "greatest"))
    kind = "bushing" if bushing else "pin"
    return Drawing(
        f"The {kind}, cut along its axis, to scale", tuple(shapes), tuple(dimensions), (),
        f"The {kind} as found, cut along its axis. mm, to scale.",
    )  # fmt: skip
