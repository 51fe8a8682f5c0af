"""Rounding of a designed strip to stock: discrete thicknesses, and width and length in steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.web.forms.groups import Group
from app.web.forms.nodes import Number, Texts
from app.web.forms.tables import Numbers

PREFERRED = (1.0, 1.12, 1.25, 1.4, 1.6, 1.8, 2.0, 2.24, 2.5, 2.8, 3.15, 3.55, 4.0, 4.5, 5.0, 5.6, 6.3, 7.1, 8.0, 9.0)
"""The R20 series of preferred numbers (ISO 3), one decade."""
_STEP_MM = 0.5
_MAX_SIZES = 200

FORM = Group(
    key="",
    name="stock",
    pointer="",
    path="",
    children=(
        Numbers(key="stock_h_mm", name="sizes", pointer="/stock_h_mm", path="stock_h_mm", unit="mm"),
        Group(
            key="step_mm",
            name="steps",
            pointer="/step_mm",
            path="step_mm",
            children=(
                Number(key="b", name="width", pointer="/step_mm/b", path="step_mm.b", unit="mm", nullable=True),
                Number(key="l", name="length", pointer="/step_mm/l", path="step_mm.l", unit="mm", nullable=True),
            ),
        ),
    ),
)
"""The sizes to enter: always in millimetres, as the series of preferred numbers is."""


def stock_offer(run: Mapping[str, Any]) -> dict[str, str] | None:
    """Texts of the form for a designed strip: the preferred thicknesses within its bounds; None if rounding does not
    apply."""
    if run["kind"] != "flexible-rod" or run["mode"] != "design" or run["status"] != "succeeded":
        return None
    if run["spec"]["stock_h_mm"] is not None:
        return None
    low, high = run["spec"]["bounds"]["h_mm"]
    sizes = [round(n * 10.0**power, 6) for power in range(-3, 3) for n in PREFERRED]
    within = [str(size) for size in sizes if low <= size <= high][:_MAX_SIZES]
    return {"sizes": " ".join(within), "width": str(_STEP_MM), "length": str(_STEP_MM)}


def rounded(run: Mapping[str, Any], texts: Texts) -> dict[str, Any]:
    """The run's spec with the stock sizes entered; text that is no number is kept for the request to refuse."""
    name = run["name"] or "Rod"
    return {**run["spec"], "name": f"{name}, to stock"[:200], **FORM.value(texts)}
