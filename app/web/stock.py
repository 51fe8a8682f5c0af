"""A found strip rounded to what can be bought and cut: the same design from a list of thicknesses and in steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

PREFERRED = (1.0, 1.12, 1.25, 1.4, 1.6, 1.8, 2.0, 2.24, 2.5, 2.8, 3.15, 3.55, 4.0, 4.5, 5.0, 5.6, 6.3, 7.1, 8.0, 9.0)
"""The R20 series of preferred numbers (ISO 3), one decade."""
_STEP_MM = 0.5
_MOST = 200


def stock_offer(run: Mapping[str, Any]) -> dict[str, Any] | None:
    """What a found strip may be rounded to: preferred thicknesses within its bounds; None where that makes no sense."""
    if run["kind"] != "flexible-rod" or run["mode"] != "design" or run["status"] != "succeeded":
        return None
    if run["spec"]["stock_h_mm"] is not None:
        return None
    low, high = run["spec"]["bounds"]["h_mm"]
    sizes = [round(n * 10.0**power, 6) for power in range(-3, 3) for n in PREFERRED]
    return {"sizes": [size for size in sizes if low <= size <= high][:_MOST], "step": _STEP_MM}


def rounded(run: Mapping[str, Any], sizes: str, width: str, length: str) -> dict[str, Any]:
    """The run's spec with the sizes to be had, as typed; what is no number stays text, which the request refuses."""
    name = run["name"] or "Rod"
    return {
        **run["spec"],
        "name": f"{name}, to stock"[:200],
        "stock_h_mm": [_number(part) for part in sizes.replace(";", " ").split()],
        "step_mm": {"b": _number(width), "l": _number(length)},
    }


def _number(text: str) -> float | str | None:
    """A number with a point or a comma; None of nothing."""
    text = text.strip()
    try:
        return float(text.replace(",", ".")) if text else None
    except ValueError:
        return text
