"""The pin or the bushing cut along its axis, with the rod's small end between the piston's bosses."""

from __future__ import annotations

from typing import Any

from app.designs.drawing import (
    Dimension,
    Drawing,
    Layer,
    Line,
    Note,
    Place,
    given,
    length,
    rectangle,
    words_of,
)

_AROUND = 0.4
"""How far bosses and small end reach beyond the pin, in its diameters."""


def drawing(request: dict[str, Any]) -> Drawing | None:
    """From a check: the section; from a design: what is given, and the least wall where there is one."""
    boss, small_end = length(request, "geometry.boss_length_mm"), length(request, "geometry.small_end_length_mm")
    gap = length(request, "geometry.gap_mm") or 0.0
    if not (boss and small_end):
        return None
    half = boss + gap + 0.5 * small_end
    bushing = request.get("variable") == "outer"
    profile = _profile(request, "outer_diameter_mm" if bushing else "bore_mm", half)
    bore = length(request, "bore_mm")
    inside = _all_along(bore, half) if bushing or not profile else profile
    outer = length(request, "geometry.outer_diameter_mm")
    outside = profile if bushing and profile else _all_along(outer, half)
    known = outside or (_all_along(2.0 * bore, half) if bushing and bore else None)
    if known is None:
        return None
    D = max(d for _, d in known)
    if not D:
        return None
    reach = (0.5 + _AROUND) * D
    shapes: list[Line] = [
        rectangle(side * a, 0.5 * D * up, side * z, reach * up, Layer.CONTEXT)
        for up in (-1, 1)
        for side, a, z in ((1, half - boss, half), (-1, half - boss, half), (1, -0.5 * small_end, 0.5 * small_end))
    ]
    if outside is None:
        shapes.append(rectangle(-half, -0.5 * D, half, 0.5 * D, Layer.HIDDEN))
    if outside and inside:
        shapes += [_cut(outside, inside, up) for up in (-1, 1)]
        shapes += [Line(((x, -0.5 * d), (x, 0.5 * d)), Layer.OUTLINE) for x, d in (inside[0], inside[-1]) if d]
    elif outside:
        shapes.append(rectangle(-half, -0.5 * D, half, 0.5 * D))
    else:
        shapes += [Line(((-half, up * 0.5 * bore), (half, up * 0.5 * bore))) for up in (-1, 1)]
    shapes.append(Line(((-half - 0.06 * D, 0.0), (half + 0.06 * D, 0.0)), Layer.CENTER))
    dimensions = [
        Dimension((half - boss, -reach), (half, -reach), words_of("boss", boss), "x", -reach, -1,
                  "geometry.boss_length_mm"),
        Dimension((-0.5 * small_end, -reach), (0.5 * small_end, -reach), words_of("small end", small_end), "x", -reach,
                  -1, "geometry.small_end_length_mm"),
        Dimension((-half, reach), (half, reach), words_of("", 2.0 * half), "x", reach, 1),
    ]  # fmt: skip
    if gap:
        edges = (-half + boss, -reach), (-0.5 * small_end, -reach)
        dimensions.append(Dimension(*edges, words_of("gap", gap), "x", -reach, -2, "geometry.gap_mm"))
    if outer and outside:
        dimensions.append(
            Dimension((-half, -0.5 * D), (-half, 0.5 * D), words_of("ø", D), "y", -half, -1,
                      "geometry.outer_diameter_mm")
        )  # fmt: skip
    if bore and inside:
        edges = (half, -0.5 * bore), (half, 0.5 * bore)
        dimensions.append(Dimension(*edges, words_of("ø", bore), "y", half, 1, "bore_mm"))
    notes, caption = [], "Cut along the axis"
    wall = length(request, "limits.min_wall_mm")
    if outside and not inside:
        notes.append(Note((0.0, 0.0), "bore to be found"))
        if wall and 2.0 * wall < D:
            shapes += [
                Line(((-half, up * (0.5 * D - wall)), (half, up * (0.5 * D - wall))), Layer.HIDDEN) for up in (-1, 1)
            ]
    if outside is None:
        caption = "The bushing's bore; its outside, dashed, is to be found"
    if wall and outside:
        edges = (half, 0.5 * D - wall), (half, 0.5 * D)
        level = 2 if bore else 1
        dimensions.append(Dimension(*edges, words_of("wall ≥", wall), "y", half, level, "limits.min_wall_mm"))
    return Drawing(
        "The bushing, cut along its axis, to scale" if bushing else "The pin, cut along its axis, to scale",
        tuple(shapes), tuple(dimensions), tuple(notes), f"{caption}. mm, to scale.",
    )  # fmt: skip


def _all_along(diameter: float | None, half: float) -> list[Place] | None:
    return None if diameter is None else [(-half, diameter), (half, diameter)]


def _profile(request: dict[str, Any], name: str, half: float) -> list[Place] | None:
    """Diameters along the whole pin from its points: half a pin stands for both halves."""
    points = given(request, "profile")
    if not isinstance(points, list) or not points:
        return None
    found = [(length(p, "x_mm"), length(p, name)) for p in points if isinstance(p, dict)]
    if any(x is None or d is None for x, d in found) or sorted(x for x, _ in found) != [x for x, _ in found]:
        return None
    along = [(min(x, 2.0 * half) - half, d) for x, d in found]
    along = [(-half, along[0][1]), *along] if along[0][0] > -half else along
    if along[-1][0] <= 1e-6 * half:
        along = [*along, (0.0, along[-1][1])]
        return along + [(-x, d) for x, d in reversed(along)]
    return along if along[-1][0] >= half * (1.0 - 1e-6) else [*along, (half, along[-1][1])]


def _cut(outside: list[Place], inside: list[Place], up: int) -> Line:
    """One of the two cut faces."""
    over = [(x, up * 0.5 * d) for x, d in outside]
    under = [(x, up * 0.5 * d) for x, d in reversed(inside)]
    return Line((*over, *under), Layer.SECTION, closed=True)
