"""What a found part is checked with."""

from __future__ import annotations

from typing import Any


def checked_as(run: dict[str, Any]) -> dict[str, Any]:
    """What a check of the part that a design found is asked with, beside what the design was asked."""
    result = run["result"] or {}
    found = {name: result[name] for name in ("dimensions", "lengths_mm") if result.get(name) is not None}
    if "lengths_mm" in found:
        # The lengths tell the type and its ratio.
        found |= {"type": None, "ratios": None}
    points = result.get("corners") or result.get("profile")
    if points:
        size = "outer_diameter_mm" if run["spec"].get("variable") == "outer" else "bore_mm"
        found["profile"] = [{"x_mm": point["x_mm"], size: point[size]} for point in points]
        found |= {"bore_mm": None} if size == "bore_mm" else {}
    return found
