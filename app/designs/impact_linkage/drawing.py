"""Drawing of the four links shortly after the blow, and at the blow, where they are collinear."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from app.designs.drawing import (
    Circle,
    Dimension,
    Drawing,
    Layer,
    Line,
    Place,
    extent,
    given,
    length,
    rectangle,
    words_of,
)
from app.designs.impact_linkage.mechanism_picture import LINKS, standing
from app.designs.units import MILLI
from solvers import linkage
from solvers.errors import InvalidInput

_TURNED = np.radians(56.0)
_PARAMETERS = (3.0, 6.0, 1.5, 12.0)
_CLOSURE_TOLERANCE = 1e-3
"""Above this closure error the linkage is drawn as it is."""
_MAX_BOX = 2.5
"""Maximum box drawn around known links, relative to their extent."""


def drawing(request: dict[str, Any]) -> Drawing | None:
    """The linkage of a check; for a design, an example for this blow, of the first allowed type."""
    try:
        found = _mechanism(request)
    except (InvalidInput, ValueError, ArithmeticError):
        return None
    if found is None:
        return None
    mechanism, paths, caption = found
    lengths = {name: getattr(mechanism.lengths, name) / MILLI for name in LINKS}
    if not all(np.isfinite(value) and 0.0 < value < 1e7 for value in lengths.values()):
        return None
    crank, base = lengths["crank"], lengths["base"]
    closes = mechanism.closure.relative < _CLOSURE_TOLERANCE
    if closes:
        phi = np.linspace(0.0, 2.0 * np.pi, 91)[:-1]
        ways = [crank * points for points in mechanism.bar.joints(phi)]
        pin, joint = (crank * points for points in mechanism.bar.joints(_TURNED))
        blow = [crank * points for points in mechanism.bar.joints(1e-9)]
    else:
        pin, joint = standing(lengths)
        ways, blow = [], []
    B, C = _place(pin), _place(joint)
    A, D = (0.0, 0.0), (base, 0.0)
    pad = length(request, "limits.joint_radius_mm") or 0.0
    size = max(lengths.values())
    shapes: list[Line | Circle] = [Circle(A, crank, Layer.CENTER)]
    if ways:
        shapes.append(Line(tuple(zip(*ways[1].tolist(), strict=True)), Layer.CENTER))
        shapes.append(Line((A, _place(blow[0]), _place(blow[1]), D), Layer.HIDDEN))
    shapes += [Line((A, D), Layer.CONTEXT), Line((A, B)), Line((B, C)), Line((C, D))]
    shapes += [Circle(at, pad or 0.012 * size, Layer.CONTEXT) for at in (A, B, C, D)]
    ends = {"base": (A, D), "crank": (A, B), "coupler": (B, C), "rocker": (D, C)}
    # The design's result is not anticipated.
    dimensions = [
        Dimension(*ends[name], words_of(name, lengths[name]), "free", path=paths.get(name, ""))
        for name in LINKS
        if paths
    ]
    room, more = _room(request, shapes, math.inf if not paths else _MAX_BOX)
    return Drawing(
        "The four links, to scale", (*shapes, *room), (*dimensions, *more),
        caption=caption + (" Dashed: at the blow." if ways else " These lengths do not close.") + " mm, to scale.",
    )  # fmt: skip


def _mechanism(request: dict[str, Any]) -> tuple[linkage.Mechanism, dict[str, str], str] | None:
    lengths = [length(request, f"lengths_mm.{name}") for name in LINKS]
    if all(lengths):
        found = linkage.of_lengths(linkage.Lengths(*(value * MILLI for value in lengths)))
        return found, {name: f"lengths_mm.{name}" for name in LINKS}, "Shortly after the blow."
    scene = _scene(request)
    if scene is None:
        return None
    named = request.get("type")
    if isinstance(named, str) and named in linkage.KINDS:
        kind = linkage.KINDS[named]
        path = f"ratios.{kind.parameter}"
        ratio = length(request, path)
        if not ratio:
            return None
        link = "base" if kind.parameter == "lambda0" else "coupler"
        return linkage.of_ratio(scene, kind, ratio), {link: path}, "Shortly after the blow."
    types = request.get("types")
    kinds = [kind for name, kind in linkage.KINDS.items() if isinstance(types, list) and name in types]
    least = (length(request, "limits.min_link_mm") or 0.0) * MILLI
    fallback = None
    for kind in kinds:
        for ratio in _PARAMETERS:
            try:
                found = linkage.of_ratio(scene, kind, ratio)
            except InvalidInput:
                continue
            caption = f"One of the mechanisms for this blow ({kind.name.replace('_', ' ')}); the design finds the best."
            if min(getattr(found.lengths, name) for name in LINKS) >= least:
                return found, {}, caption
            fallback = fallback or (found, {}, caption)
    return fallback


def _scene(request: dict[str, Any]) -> linkage.Scene | None:
    """The scene, with a nominal size if none is given."""
    blow = given(request, "restitution")
    low = length(request, "restitution.low") if isinstance(blow, dict) else length(request, "restitution")
    high = length(request, "restitution.high") if isinstance(blow, dict) else low
    if not low or not high:
        return None
    tool = length(request, "tool_radius_mm")
    return linkage.Scene(
        linkage.Restitution(low, high),
        length(request, "blow_frequency_hz") or 1.0,
        length(request, "impact_speed_m_s") or 1.0,
        length(request, "impact_energy_j") or 1.0,
        tool * MILLI if tool else None,
    )


def _room(
    request: dict[str, Any], shapes: list[Line | Circle], most: float
) -> tuple[list[Line | Circle], list[Dimension]]:
    """The box or pipe limiting the linkage, around the centre of its swept area."""
    wide, high = length(request, "limits.width_mm"), length(request, "limits.height_mm")
    pipe = length(request, "limits.enclosing_radius_mm")
    xs, ys = zip(*(place for shape in shapes for place in extent(shape)), strict=True)
    x, y = 0.5 * (min(xs) + max(xs)), 0.5 * (min(ys) + max(ys))
    own_wide, own_high = max(xs) - min(xs), max(ys) - min(ys)
    out: list[Line | Circle] = []
    dimensions: list[Dimension] = []
    # A box so large that the links would not be visible is not drawn.
    seen = most * max(own_wide, own_high)
    if max(wide or 0.0, high or 0.0) > seen:
        wide = high = None
    if pipe and 2.0 * pipe > seen:
        pipe = None
    if wide or high:
        w, h = 0.5 * (wide or own_wide), 0.5 * (high or own_high)
        out.append(rectangle(x - w, y - h, x + w, y + h, Layer.HIDDEN))
        if wide:
            edges = (x - w, y - h), (x + w, y - h)
            dimensions.append(Dimension(*edges, words_of("≤", wide), "x", y - h, -1, "limits.width_mm"))
        if high:
            edges = (x - w, y - h), (x - w, y + h)
            dimensions.append(Dimension(*edges, words_of("≤", high), "y", x - w, -1, "limits.height_mm"))
    if pipe:
        out.append(Circle((x, y), pipe, Layer.HIDDEN))
        edges = (x, y), (x + pipe, y)
        dimensions.append(Dimension(*edges, words_of("≤", pipe), "free", path="limits.enclosing_radius_mm"))
    return out, dimensions


def _place(points: Any) -> Place:
    x, y = np.asarray(points, float).reshape(2)
    return float(x), float(y)
