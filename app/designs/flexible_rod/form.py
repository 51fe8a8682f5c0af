"""Wording and layout of the rod's forms."""

from app.designs.form import FormWords
from solvers import rod


def _steel(name: str) -> str:
    m = rod.CATALOGUE[name]
    return (
        f"{name.replace('-', ' ')}: E {m.elastic_modulus / 1e9:g} GPa, fatigue limit {m.fatigue_limit / 1e6:g} MPa, "
        f"yield {m.yield_strength / 1e6:g} MPa"
    )


FORM = FormWords(
    sections={
        "Machine": ("mechanism",),
        "Piston": ("piston",),
        "Pressure": ("load",),
        "Material": ("material",),
        "Strip": ("dimensions",),
        "Requirements": ("requirements", "objective"),
        "Search range": ("bounds", "stock_h_mm", "step_mm"),
        "+Fatigue": ("fatigue_criterion",),
    },
    labels={
        "piston.diameter_mm": "Diameter",
        "piston.skirt_length_mm": "Length of the skirt",
        "piston.reciprocating_mass_kg": "Reciprocating mass",
        "piston.clamp_offset_mm": "Offset of the clamp e",
        "piston.friction_coefficient": "Coefficient of friction",
        "load": "Pressure on the piston",
        "load.p_min_mpa": "Least pressure",
        "load.delta": "Compression parameter δ",
        "load.theta_rad": "Angle of greatest pressure θ",
        "load.constant_pressure_mpa": "Pressure",
        "load.points": "Pressures over one turn",
        "material": "Material of the strip",
        "material.name": "Steel",
        "material.fatigue_limit_mpa": "Fatigue limit σ₋₁",
        "material.fatigue_reduction": "Fatigue reduction K",
        "material.mean_stress_sensitivity": "Sensitivity to mean stress ψ",
        "material.ultimate_strength_mpa": "Ultimate strength",
        "material.loss_factor": "Loss factor η",
        "dimensions.b_mm": "Width b",
        "dimensions.h_mm": "Thickness h",
        "dimensions.l_mm": "Free length l",
        "bounds.b_mm": "Width b",
        "bounds.h_mm": "Thickness h",
        "bounds.l_mm": "Free length l",
        "stock_h_mm": "Thicknesses in stock",
        "step_mm": "Rounding",
        "step_mm.b": "Width in steps of",
        "step_mm.l": "Free length in steps of",
        "objective": "Objective",
        "requirements.min_fatigue_safety": "Safety against fatigue, at least",
        "requirements.min_stability_safety": "Safety against buckling, at least",
        "requirements.min_yield_safety": "Safety against yield, at least",
        "requirements.max_contact_pressure_mpa": "Pressure of the skirt on the cylinder, at most",
        "requirements.max_friction_power_w": "Power lost in friction, at most",
        "fatigue_criterion": "Fatigue criterion",
    },
    helps={
        "mechanism.crank_radius_mm": "less than the rod's length",
        "mechanism.rod_length_mm": "from the clamp in the piston to the crank pin",
        "piston.clamp_offset_mm": "from mid-skirt toward the crank",
        "dimensions.h_mm": "in the direction in which the strip bends",
        "dimensions.l_mm": "at most the rod's length",
        "requirements.min_fatigue_safety": "",
        "requirements.min_stability_safety": "",
        "requirements.min_yield_safety": "empty: 1, and only judged, not required",
        "requirements.max_contact_pressure_mpa": "takes friction into account",
        "requirements.max_friction_power_w": "takes friction into account",
        "material.mean_stress_sensitivity": "",
        "material.name": "typical values for preliminary design, not for release: scatter between heats is easily 15 %",
        "load.indicator": "",
        "stock_h_mm": "the result has one of these, such as 0.4; 0.5; 0.6. Empty: any thickness",
        "bounds.b_mm": "",
        "bounds.h_mm": "",
        "bounds.l_mm": "",
        "load.strokes": "stroke 1 expansion, 2 compression; volumes with the clearance volume",
    },
    options={
        "load": {
            "schmidt": "Stirling machine (Schmidt cycle)",
            "table": "table over the crank angle",
            "constant": "one pressure at all angles",
            "indicator": "indicator diagram",
            "run": "stored run of crank dynamics",
        },
        "worst_fibre": {"1": "outer, +h/2", "-1": "inner, −h/2"},
        "material": {"custommaterial": "its properties", "cataloguematerial": "from the list"},
        "material.name": {name: _steel(name) for name in rod.CATALOGUE},
        "objective": {
            "mass": "least mass",
            "friction_power": "least power lost in friction",
            "contact_pressure": "least pressure of the skirt on the cylinder",
            "side_force": "least side force",
            "fatigue_safety": "greatest safety against fatigue",
            "stability_safety": "greatest safety against buckling",
        },
        "fatigue_criterion": {
            "serensen": "Serensen",
            "goodman": "Goodman",
            "gerber": "Gerber",
            "soderberg": "Soderberg",
            "fkm": "FKM guideline",
        },
    },
    sliders=frozenset({"dimensions.b_mm", "dimensions.h_mm", "dimensions.l_mm"}),
    starts={
        "load": {
            "table": {
                "kind": "table",
                "angle_deg": [0, 60, 120, 180, 240, 300],
                "pressure_mpa": [2.0, 2.3, 1.9, 1.5, 1.4, 1.6],
            },
            "constant": {"kind": "constant", "constant_pressure_mpa": 0.5},
        },
        "material": {"cataloguematerial": {"name": "spring-steel-1.1274"}},
    },
)
