"""Check requests for designed parts."""

from __future__ import annotations

from typing import Any


def checked_as(run: dict[str, Any]) -> dict[str, Any]:
    """The fields that turn a design run's request into a check of the part found."""
    result = run["result"] or {}
    found = {name: result[name] for name in ("dimensions", "lengths_mm") if result.get(name) is not None}
    if "lengths_mm" in found:
        # The lengths determine the type and its ratio.
        found |= {"type": None, "ratios": None}
    points = result.get("corners") or result.get("profile")
    if points:
        size = "outer_diameter_mm" if run["spec"].get("variable") == "outer" else "bore_mm"
        found["profile"] = [{"x_mm": point["x_mm"], size: point[size]} for point in points]
        found |= {"bore_mm": None} if size == "bore_mm" else {}
    return found
