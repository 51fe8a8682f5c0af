"""Criteria of a strip, in the names and units of the API."""

from __future__ import annotations

from app.designs.verdict import Word

WORDS = {
    "min_fatigue_safety": Word("min_fatigue_safety", "fatigue safety"),
    "min_stability_safety": Word("min_stability_safety", "safety against buckling"),
    "min_yield_safety": Word("min_yield_safety", "safety against yield"),
    "max_contact_pressure": Word("max_contact_pressure_mpa", "contact pressure of the skirt"),
    "max_friction_power": Word("max_friction_power_w", "friction power"),
    "fatigue_safety": Word("fatigue_safety", "fatigue safety"),
    "stability_safety": Word("stability_safety", "safety against buckling"),
    "yield_safety": Word("yield_safety", "safety against yield"),
}
