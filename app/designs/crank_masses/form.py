"""Wording and layout of the form."""

from app.designs.form import FormWords

FORM = FormWords(
    sections={"Rod": ("method",)},
    labels={
        "method": "How it is measured",
        "pivot_distance_mm": "Distance between the knife edges",
        "period_small_end_s": "Period, hung at the small end",
        "period_big_end_s": "Period, hung at the big end",
        "rod_mass_kg": "Mass of the rod",
        "amplitude_deg": "Amplitude of the swing",
        "gravity_m_s2": "Gravity",
        "small_end_bore_radius_mm": "Radius of the small end's bore",
        "big_end_bore_radius_mm": "Radius of the big end's bore",
        "length_mm": "Distance between the pin centres",
        "small_end_reading_kg": "Scale under the small end",
        "big_end_reading_kg": "Scale under the big end",
        "bore_mm": "Bore of the engine",
        "piston_kg_m2": "Piston group per piston area",
        "rod_kg_m2": "Rod per piston area",
        "uncertainty": "Standard uncertainties",
    },
    options={
        "method": {
            "pendulum": "swinging it on both ends",
            "weighing": "weighing both ends",
            "estimate": "estimate from other engines",
        }
    },
    starts={
        "method": {
            "weighing": {
                "length_mm": 145.0,
                "small_end_reading_kg": 0.18,
                "big_end_reading_kg": 0.44,
                "rod_mass_kg": 0.62,
                "period_small_end_s": 0.775,
            },
            "estimate": {"bore_mm": 80.0, "piston_kg_m2": 90.0, "rod_kg_m2": 120.0},
        }
    },
    hidden=frozenset({"effects", "effect_tolerance", "accuracy"}),
)
