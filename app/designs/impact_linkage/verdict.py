"""Criteria of a linkage, in the names and units of the API."""

from __future__ import annotations

from app.designs.verdict import Word

WORDS = {
    "turns_fully": Word("rotatable", "crank turns fully", no="the crank cannot turn fully"),
    "strikes": Word("strikes", "rocker strikes", no="the rocker cannot strike: its links do not close for a blow"),
    "runs_steadily": Word(
        "runs_steadily", "motor keeps it running", no="the motor does not keep it running at the speed required"
    ),
    "impact_speed": Word("impact_speed_m_s", "speed of the blow"),
    "greatest_impact_speed": Word("greatest_impact_speed_m_s", "speed of the blow"),
    "min_link": Word("min_link_mm", "shortest link"),
    "longest_link": Word("longest_link_mm", "longest link"),
    "width": Word("width_mm", "width of the swept box"),
    "height": Word("height_mm", "height of the swept box"),
    "enclosing_radius": Word("enclosing_radius_mm", "radius around all it sweeps"),
    "max_pin_force": Word("max_pin_force_n", "pin force"),
    "coupler_peak": Word("coupler_peak_n", "pin force after a blow that mismatches"),
    "least_transmission_angle": Word("transmission_angle_deg.0", "least transmission angle"),
    "greatest_transmission_angle": Word("transmission_angle_deg.1", "greatest transmission angle"),
}
