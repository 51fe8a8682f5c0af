"""Drawing of the strip at the top dead centre, in side and front view."""

from __future__ import annotations

from typing import Any

from app.designs.drawing import Circle, Dimension, Drawing, Layer, Line, given, length, rectangle, signed, words_of


def drawing(request: dict[str, Any]) -> Drawing | None:
    """The strip of a check; for a design, the largest allowed strip, with the smallest dashed."""
    radius, rod = length(request, "mechanism.crank_radius_mm"), length(request, "mechanism.rod_length_mm")
    diameter, skirt = length(request, "piston.diameter_mm"), length(request, "piston.skirt_length_mm")
    offset = signed(request, "piston.clamp_offset_mm") or 0.0
    if not (radius and rod and diameter and skirt):
        return None
    bounds = isinstance(given(request, "bounds"), dict)
    sizes = {n: _sizes(request, n, bounds) for n in ("b_mm", "h_mm", "l_mm")}
    if any(value is None for pair in sizes.values() for value, _ in pair):
        return None
    (b, _), (h, _), (l, _) = (sizes[name][-1] for name in ("b_mm", "h_mm", "l_mm"))
    half, center = 0.5 * diameter, rod + radius
    left, right = -offset - 0.5 * skirt, -offset + 0.5 * skirt
    head = max(0.09 * diameter, 0.9 * h)
    down = -(half + 0.16 * diameter + 0.5 * b)
    shapes: list[Line | Circle] = [
        Line(((left - 0.1 * skirt, 0.0), (center + 1.3 * radius, 0.0)), Layer.CENTER),
        Line(((left - 0.1 * skirt, half), (right + 2.2 * radius + 0.1 * skirt, half)), Layer.CONTEXT),
        Line(((left - 0.1 * skirt, -half), (right + 2.2 * radius + 0.1 * skirt, -half)), Layer.CONTEXT),
        rectangle(left, -half, right, half, Layer.CONTEXT),
        rectangle(-0.06 * skirt, -head, 0.0, head, Layer.SECTION),
        Circle((center, 0.0), radius, Layer.CENTER),
        Circle((rod, 0.0), 0.09 * diameter, Layer.CONTEXT),
        rectangle(0.0, -0.5 * h, l, 0.5 * h, Layer.SECTION),
        rectangle(-0.06 * skirt, down - 0.55 * b, 0.0, down + 0.55 * b, Layer.SECTION),
        rectangle(0.0, down - 0.5 * b, l, down + 0.5 * b),
    ]
    if rod > l:
        shapes += [
            rectangle(l, -head, rod, head, Layer.CONTEXT),
            rectangle(l, down - 0.55 * b, rod, down + 0.55 * b, Layer.CONTEXT),
        ]
    dimensions = [
        Dimension((0.0, 0.0), (rod, 0.0), words_of("L", rod), "x", half, 1, "mechanism.rod_length_mm"),
        Dimension((left, half), (right, half), words_of("skirt", skirt), "x", half, 2, "piston.skirt_length_mm"),
        Dimension((left, -half), (left, half), words_of("ø", diameter), "y", left, -1, "piston.diameter_mm"),
        Dimension((center, 0.0), (center, -radius), words_of("r", radius), "y", center + radius, 2,
                  "mechanism.crank_radius_mm"),
    ]  # fmt: skip
    if offset:
        dimensions.append(
            Dimension((-offset, 0.0), (0.0, 0.0), words_of("e", offset), "x", -half, -1, "piston.clamp_offset_mm")
        )
    least = len(sizes["l_mm"]) > 1
    if least:
        low_b, low_l = sizes["b_mm"][0][0], sizes["l_mm"][0][0]
        shapes.append(rectangle(0.0, down - 0.5 * low_b, low_l, down + 0.5 * low_b, Layer.HIDDEN))
    for level, (value, path) in enumerate(sizes["l_mm"], start=1):
        dimensions.append(
            Dimension((0.0, down), (value, down), _named("l", value, path), "x", down - 0.55 * b, -level, path)
        )
    for level, (value, path) in enumerate(sizes["b_mm"], start=1):
        edges = (0.0, down - 0.5 * value), (0.0, down + 0.5 * value)
        dimensions.append(Dimension(*edges, _named("b", value, path), "y", -0.06 * skirt, -level, path))
    for level, (value, path) in enumerate(sizes["h_mm"][::-1]):
        place = (0.15 + 0.7 * level if least else 0.35) * l
        edges = (place, -0.5 * value), (place, 0.5 * value)
        dimensions.append(Dimension(*edges, _named("h", value, path), "y", place, 0, path))
    return Drawing(
        "The strip in its machine, to scale", tuple(shapes), tuple(dimensions),
        caption="Top dead centre, from the side; below, the strip from its broad face. mm, to scale"
        + (": the greatest strip allowed, the least one dashed." if least else "."),
    )  # fmt: skip


def _sizes(request: dict[str, Any], name: str, bounds: bool) -> list[tuple[float | None, str]]:
    """A dimension and its field; for a design, its lower and upper bounds."""
    paths = [f"bounds.{name}.0", f"bounds.{name}.1"] if bounds else [f"dimensions.{name}"]
    return [(length(request, path) or None, path) for path in paths]


def _named(symbol: str, value: float, path: str) -> str:
    sign = {"0": " ≥", "1": " ≤"}.get(path[-1], "")
    return words_of(symbol + sign, value)
