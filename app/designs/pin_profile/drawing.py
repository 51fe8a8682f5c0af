"""Axial section of the pin or bushing, with small end and bosses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.designs.drawing import (
    Dimension,
    Drawing,
    Layer,
    Line,
    Note,
    Outline,
    Place,
    given,
    length,
    rectangle,
    words_of,
)
from app.designs.pin_profile.part import Span, all_along, section, straight_between, walls

_SURROUNDINGS = 0.4
"""Radial extent of bosses and small end beyond the pin, in pin diameters."""
_PIN, _BUSHING = "The pin, cut along its axis, to scale", "The bushing, cut along its axis, to scale"
Shapes = list[Line | Outline]


@dataclass(frozen=True)
class _Seats:
    """Seats along the part: boss, gap, small end, gap, boss; mm."""

    boss: float
    small_end: float
    gap: float

    @property
    def length(self) -> float:
        return 2.0 * (self.boss + self.gap) + self.small_end

    def around(self, outer: float, reach: float) -> Shapes:
        """Bosses and small end from the part's outer diameter to ``reach``, and the axis."""
        L, c = self.length, self.boss + self.gap
        ends = ((0.0, self.boss), (c, c + self.small_end), (L - self.boss, L))
        shapes: Shapes = [
            rectangle(start, 0.5 * outer * up, end, reach * up, Layer.CONTEXT) for up in (-1, 1) for start, end in ends
        ]
        return [*shapes, Line(((-0.06 * outer, 0.0), (L + 0.06 * outer, 0.0)), Layer.CENTER)]

    def dimensions(self, reach: float) -> list[Dimension]:
        """Of the seats: below one another, as a text longer than its line extends to its right."""
        L, c = self.length, self.boss + self.gap
        dimensions = [
            Dimension((L - self.boss, -reach), (L, -reach), words_of("boss", self.boss), "x", -reach, -1,
                      "geometry.boss_length_mm"),
            Dimension((c, -reach), (c + self.small_end, -reach), words_of("small end", self.small_end), "x", -reach,
                      -2, "geometry.small_end_length_mm"),
            Dimension((0.0, reach), (L, reach), words_of("", L), "x", reach, 1),
        ]  # fmt: skip
        if self.gap:
            edges = (self.boss, -reach), (c, -reach)
            dimensions.append(Dimension(*edges, words_of("gap", self.gap), "x", -reach, -3, "geometry.gap_mm"))
        return dimensions


def in_machine(run: Mapping[str, Any]) -> Drawing:
    """The run's part between bosses and small end."""
    g, (bore, outside) = run["spec"]["geometry"], walls(run)
    seats = _Seats(g["boss_length_mm"], g["small_end_length_mm"], g["gap_mm"])
    outer = _greatest(outside)
    reach = (0.5 + _SURROUNDINGS) * outer
    shapes = [*seats.around(outer, reach), *_cut(bore, outside, seats.length)]
    title = _BUSHING if run["spec"]["variable"] == "outer" else _PIN
    return Drawing(title, tuple(shapes), tuple(seats.dimensions(reach)), caption="Cut along the axis. mm, to scale.")


def drawing(request: dict[str, Any]) -> Drawing | None:
    """The section of a check; for a design, the given dimensions, and the minimum wall if any."""
    boss, small_end = length(request, "geometry.boss_length_mm"), length(request, "geometry.small_end_length_mm")
    if not (boss and small_end):
        return None
    seats = _Seats(boss, small_end, length(request, "geometry.gap_mm") or 0.0)
    L = seats.length
    bushing = request.get("variable") == "outer"
    profile = _profile(request, "outer_diameter_mm" if bushing else "bore_mm", L)
    bore, outer = length(request, "bore_mm"), length(request, "geometry.outer_diameter_mm")
    inside = (None if bore is None else all_along(bore, L)) if bushing or not profile else profile
    outside = profile if bushing and profile else None if outer is None else all_along(outer, L)
    D = _greatest(outside) if outside else 2.0 * bore if bushing and bore else 0.0
    if not D:
        return None
    reach = (0.5 + _SURROUNDINGS) * D
    shapes = seats.around(D, reach)
    if outside and inside:
        shapes += _cut(inside, outside, L)
    elif outside:
        shapes.append(rectangle(0.0, -0.5 * D, L, 0.5 * D))
    else:
        shapes.append(rectangle(0.0, -0.5 * D, L, 0.5 * D, Layer.HIDDEN))
        shapes += [Line(((0.0, up * 0.5 * bore), (L, up * 0.5 * bore))) for up in (-1, 1)]
    dimensions, notes = seats.dimensions(reach), []
    if outer and outside:
        dimensions.append(
            Dimension((0.0, -0.5 * D), (0.0, 0.5 * D), words_of("ø", D), "y", 0.0, -1, "geometry.outer_diameter_mm")
        )
    if bore and inside:
        edges = (L, -0.5 * bore), (L, 0.5 * bore)
        dimensions.append(Dimension(*edges, words_of("ø", bore), "y", L, 1, "bore_mm"))
    wall = length(request, "limits.min_wall_mm")
    if outside and not inside:
        notes.append(Note((0.5 * L, 0.0), "bore to be found"))
        if wall and 2.0 * wall < D:
            edge = 0.5 * D - wall
            shapes += [Line(((0.0, up * edge), (L, up * edge)), Layer.HIDDEN) for up in (-1, 1)]
    if wall and outside:
        edges = (L, 0.5 * D - wall), (L, 0.5 * D)
        level = 2 if bore else 1
        dimensions.append(Dimension(*edges, words_of("wall ≥", wall), "y", L, level, "limits.min_wall_mm"))
    caption = "Cut along the axis" if outside else "The bushing's bore; its outside, dashed, is to be found"
    title = _BUSHING if bushing else _PIN
    return Drawing(title, tuple(shapes), tuple(dimensions), tuple(notes), f"{caption}. mm, to scale.")


def _greatest(spans: Sequence[Span]) -> float:
    return max(d for span in spans for d in (span.first, span.last))


def _cut(bore: Sequence[Span], outside: Sequence[Span], L: float) -> Shapes:
    """Both section faces, and the ends of the bore."""
    shapes: Shapes = [section(bore, outside, L, sign) for sign in (1.0, -1.0)]
    ends = ((0.0, bore[0].first), (L, bore[-1].last))
    return shapes + [Line(((x, -0.5 * d), (x, 0.5 * d))) for x, d in ends if d]


def _profile(request: dict[str, Any], name: str, L: float) -> list[Span] | None:
    """Diameters along the whole part from its points; half a part is mirrored."""
    points = given(request, "profile")
    if not isinstance(points, list) or not points:
        return None
    found: list[Place] = []
    for point in points:
        x, d = (length(point, key) if isinstance(point, dict) else None for key in ("x_mm", name))
        if x is None or d is None or (found and x < found[-1][0]):
            return None
        found.append((x, d))
    return straight_between(found, L) or None
