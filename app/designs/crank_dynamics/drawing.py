"""Drawing of crank, rod and cylinder, 50 degrees after the top dead centre."""

from __future__ import annotations

import math
from typing import Any

from app.designs.drawing import Circle, Dimension, Drawing, Layer, Line, length, rectangle, signed, words_of

_TURNED = math.radians(50.0)
_CROWN, _SKIRT = 0.35, 0.35
"""Piston height above and below the pin, in bores; illustrative only."""


def drawing(request: dict[str, Any]) -> Drawing | None:
    """The mechanism to scale, except for the piston's height."""
    r, rod = length(request, "mechanism.crank_radius_mm"), length(request, "mechanism.rod_length_mm")
    bore, e = length(request, "cylinder.bore_mm"), signed(request, "mechanism.offset_mm") or 0.0
    if not (r and rod and bore) or abs(e) + r >= rod:
        return None
    clearance = 1e3 * (length(request, "cylinder.clearance_volume_cm3") or 0.0) / (0.25 * math.pi * bore**2)
    pin = (r * math.sin(_TURNED), r * math.cos(_TURNED))
    wrist = (e, pin[1] + math.sqrt(rod**2 - (pin[0] - e) ** 2))
    top, bottom = (math.sqrt((rod + s * r) ** 2 - e**2) for s in (1, -1))
    crown, skirt, half = _CROWN * bore, _SKIRT * bore, 0.5 * bore
    roof = top + crown + min(clearance, 3.0 * bore)
    foot = bottom - skirt
    shapes: list[Line | Circle] = [
        Line(((e - half, foot), (e - half, roof), (e + half, roof), (e + half, foot)), Layer.CONTEXT),
        rectangle(e - 0.97 * half, wrist[1] - skirt, e + 0.97 * half, wrist[1] + crown, Layer.CONTEXT),
        Line(((e, -1.15 * r), (e, roof + 0.1 * bore)), Layer.CENTER),
        Line(((e - half, top + crown), (e + half, top + crown)), Layer.HIDDEN),
        Circle((0.0, 0.0), r, Layer.CENTER),
        Line((wrist, pin)),
        Line((pin, (0.0, 0.0))),
        Circle(wrist, 0.05 * bore),
        Circle(pin, 0.06 * bore),
        Circle((0.0, 0.0), 0.08 * bore),
    ]
    dimensions = [
        Dimension((e - half, roof), (e + half, roof), words_of("ø", bore), "x", roof, 1, "cylinder.bore_mm"),
        Dimension((0.0, 0.0), pin, words_of("r", r), "free", path="mechanism.crank_radius_mm"),
        Dimension(pin, wrist, words_of("L", rod), "free", path="mechanism.rod_length_mm"),
        Dimension((e - half, top - bottom + bottom + crown), (e - half, bottom + crown),
                  words_of("stroke", top - bottom), "y", e - half, -1),
    ]  # fmt: skip
    if clearance:
        dimensions.append(
            Dimension((e + half, top + crown), (e + half, roof), f"{clearance:.3g}", "y", e + half, 1,
                      "cylinder.clearance_volume_cm3")
        )  # fmt: skip
    if e:
        dimensions.append(Dimension((0.0, 0.0), (e, 0.0), words_of("e", e), "x", -1.15 * r, -1, "mechanism.offset_mm"))
    cg = length(request, "masses.rod_cg_from_pin_mm")
    if cg and cg <= rod:
        share = cg / rod
        at = (wrist[0] + share * (pin[0] - wrist[0]), wrist[1] + share * (pin[1] - wrist[1]))
        shapes.append(Circle(at, 0.03 * bore))
        dimensions.append(Dimension(wrist, at, words_of("cg", cg), "y", e + half, 2, "masses.rod_cg_from_pin_mm"))
    return Drawing(
        "Crank, rod and cylinder, to scale", tuple(shapes), tuple(dimensions),
        caption="50° after the top dead centre; dashed, the piston's crown there. mm, to scale, except "
        "for the piston's height.",
    )  # fmt: skip
