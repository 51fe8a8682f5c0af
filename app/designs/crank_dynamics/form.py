"""Wording and layout of the form."""

from app.designs.form import FormWords

FORM = FormWords(
    sections={
        "Mechanism": ("mechanism",),
        "Cylinder": ("cylinder",),
        "Pressure": ("pressure",),
        "Masses": ("masses",),
        "Engine": ("engine",),
        "+Results over the cycle": ("series_angles",),
    },
    labels={
        "mechanism.offset_mm": "Offset of the cylinder axis e",
        "cylinder.bore_mm": "Cylinder bore",
        "cylinder.crankcase_pressure_mpa": "Pressure under the piston",
        "cylinder.strokes": "Strokes per cycle",
        "pressure": "Pressure in the cylinder",
        "pressure.points": "Pressures over one cycle",
        "pressure.strokes": "Points of the diagram",
        "masses.piston_kg": "Piston group",
        "masses.rod_kg": "Connecting rod",
        "masses.rod_cg_from_pin_mm": "Wrist pin to the rod's centre of mass",
        "masses.rod_inertia_kg_m2": "Rod's moment of inertia",
        "masses.crank_pin_kg": "Crank pin",
        "masses.web_kg": "One web",
        "masses.web_radius_mm": "Radius of the web's centre of mass",
        "masses.counterweight_kg": "Total mass of the counterweights",
        "masses.counterweight_radius_mm": "Radius of their centre of mass",
        "masses.rods_per_pin": "Rods on a crank pin",
        "engine": "Several cylinders on one shaft",
        "engine.cylinders": "Cylinders",
        "engine.phases_deg": "Crank angles of their cycles",
        "engine.bank_deg": "Directions of the cylinders",
        "engine.positions_mm": "Positions along the shaft",
        "engine.flywheel_inertia_kg_m2": "Flywheel's moment of inertia",
        "engine.wanted_irregularity": "Required irregularity of speed",
        "series_angles": "Angles in the results",
    },
    helps={
        "mechanism.crank_radius_mm": "less than the rod's length",
        "mechanism.rod_length_mm": "from the wrist pin to the crank pin",
        "mechanism.offset_mm": "positive toward the side to which the crank turns from the top",
        "pressure.strokes": "strokes 1 to 4: intake, compression, expansion, exhaust; with two: expansion, compression",
        "engine.phases_deg": "by how much each cylinder's cycle follows the first one's, such as 0; 540; 180; 360",
        "engine.positions_mm": "such as 0; 90; 180; 270, for the couples",
        "engine.bank_deg": "of a V, with the cylinders alternately left and right",
        "masses.rods_per_pin": "2 where the rods of a V share a pin",
    },
    options={
        "pressure": {"table": "table over the crank angle", "indicator": "indicator diagram"},
        "cylinder.strokes": {"2": "two", "4": "four"},
        "engine.bank_deg": {"number": "angle of the V (0: in line)", "list": "each cylinder's own"},
    },
    sliders=frozenset({"mechanism.speed_hz"}),
    starts={
        "pressure": {
            "table": {
                "kind": "table",
                "angle_deg": [0, 90, 180, 270, 330, 360, 375, 400, 450, 540, 630],
                "pressure_mpa": [0.1, 0.09, 0.09, 0.2, 0.9, 2.2, 4.5, 3.2, 0.9, 0.4, 0.11],
            }
        }
    },
)
