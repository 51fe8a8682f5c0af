"""By which results a linkage's accuracy is judged, and which one stands for a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.designs.kind import Mode

MAIN_RESULTS = (
    "u31_start",
    "u31_end",
    "u31_max",
    "kinematic_restitution",
    "transmission_angle_deg",
    "impact_speed_m_s",
    "longest_link_mm",
    "box_area_mm2",
    "enclosing_radius_mm",
    "peak_torque_nm",
    "pin_force_n",
    "running_frequency_hz",
    "running_speed_m_s",
    "irregularity",
    "motor_power_w",
)
"""What an accuracy study judges. Not the box's sides or angle, nor the angles of peaks: where the area or the load is
flat in them they are uncertain by the square root of its own error."""

_FIGURES = {
    "box_area": "box_area_mm2",
    "longest_link": "longest_link_mm",
    "enclosing_radius": "enclosing_radius_mm",
    "peak_torque": "peak_torque_nm",
    "pin_force": "pin_force_n",
    "impact_speed": "impact_speed_m_s",
    "blow_frequency": "blow_frequency_hz",
}


def figure(mode: Mode, result: Mapping[str, Any]) -> tuple[str, float | None]:
    """What a design was after; of a check the longest link, where lengths are known; of a study none."""
    if mode is Mode.DESIGN:
        return _FIGURES[result["objective"]], result["value"]
    return "longest_link_mm", result.get("longest_link_mm")
