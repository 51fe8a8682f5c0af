"""Rounding of a designed strip to stock: discrete thicknesses, and width and length in steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

PREFERRED = (1.0, 1.12, 1.25, 1.4, 1.6, 1.8, 2.0, 2.24, 2.5, 2.8, 3.15, 3.55, 4.0, 4.5, 5.0, 5.6, 6.3, 7.1, 8.0, 9.0)
"""The R20 series of preferred numbers (ISO 3), one decade."""
_STEP_MM = 0.5
_MAX_SIZES = 200


def stock_offer(run: Mapping[str, Any]) -> dict[str, Any] | None:
    """Preferred thicknesses [mm] within the bounds of a designed strip; None if rounding does not apply."""
    if run["kind"] != "flexible-rod" or run["mode"] != "design" or run["status"] != "succeeded":
        return None
    if run["spec"]["stock_h_mm"] is not None:
        return None
    low, high = run["spec"]["bounds"]["h_mm"]
    sizes = [round(n * 10.0**power, 6) for power in range(-3, 3) for n in PREFERRED]
    return {"sizes": [size for size in sizes if low <= size <= high][:_MAX_SIZES], "step": _STEP_MM}


def rounded(run: Mapping[str, Any], sizes: str, width: str, length: str) -> dict[str, Any]:
    """The run's spec with the stock sizes entered; non-numeric text is kept for the request to refuse."""
    name = run["name"] or "Rod"
    return {
        **run["spec"],
        "name": f"{name}, to stock"[:200],
        "stock_h_mm": [_number(part) for part in sizes.replace(";", " ").split()],
        "step_mm": {"b": _number(width), "l": _number(length)},
    }


def _number(text: str) -> float | str | None:
    """A number with decimal point or comma; None if empty, the text if not a number."""
    text = text.strip()
    try:
        return float(text.replace(",", ".")) if text else None
    except ValueError:
        return text
