"""Wording and layout of the pin's forms."""

from app.designs.form import FormWords, Switch
from solvers import pin


def _steel(name: str) -> str:
    m = pin.CATALOGUE[name]
    return f"{name.removeprefix('pin-steel-')}: allowable stress {m.allowable_stress / 1e6:g} MPa, {_treated(m.title)}"


def _treated(title: str) -> str:
    return title.rpartition(", ")[2]


FORM = FormWords(
    sections={
        "Part": ("variable", "geometry"),
        "Load": ("load",),
        "Material and strength": ("material", "criterion"),
        "Bore": ("form", "bore_mm", "profile"),
        "Limits": ("limits",),
    },
    switches={
        "given": Switch(
            "The diameter that is checked",
            {"one": "the same all along", "points": "a table of points"},
            lambda request: "points" if request.get("profile") else "one",
            "Bore",
            "check",
        )
    },
    labels={
        "variable": "What is it?",
        "geometry.outer_diameter_mm": "Outer diameter D",
        "geometry.boss_length_mm": "Length in each boss",
        "geometry.small_end_length_mm": "Length in the small end",
        "geometry.gap_mm": "Gap beside the small end",
        "load": "Load",
        "load.force_n": "Greatest force on the piston",
        "material": "Material",
        "material.name": "Steel",
        "material.allowable_stress_mpa": "Allowable stress",
        "material.allowable_shear_mpa": "Allowable shear stress",
        "criterion": "Equivalent stress",
        "limits.min_wall_mm": "Wall, at least",
        "limits.max_deflection_um": "Deflection, at most",
        "limits.max_ovalization_um": "Ovalization, at most",
        "limits.max_slope": "Slope of the bore, at most",
        "limits.max_ring_stress_mpa": "Ring stress, at most",
        "form.kind": "Form sought",
        "form.steps": "Steps from each end",
        "bore_mm": "Bore",
        "profile": "Diameters along the part",
        "x_mm": "from the end",
        "profile.bore_mm": "bore",
        "outer_diameter_mm": "outer diameter",
    },
    helps={
        "geometry.boss_length_mm": "of the piston, on either side",
        "geometry.small_end_length_mm": "",
        "geometry.outer_diameter_mm": "",
        "form": "",
        "bore_mm": "",
        "variable": "",
        "load.force_n": "",
        "limits.max_ring_stress_mpa": "hoop stress; empty: judged by the allowable stress, yet no limit. "
        "Hardened pins: 300 to 350 MPa",
        "limits.max_ovalization_um": "takes ovalization into account",
        "limits.max_slope": "change of diameter per length, for what a tool can turn",
        "limits.min_wall_mm": "",
        "material.name": "for preliminary design, not for release: the allowable stress is a convention, "
        "not a property of the steel",
        "material.allowable_shear_mpa": "empty: only the equivalent stress is judged",
        "profile": "a line for each point; two points at one place are a step; half a part stands for both halves",
    },
    options={
        "variable": {"bore": "a pin: its bore is in question", "outer": "a bushing: its outside is in question"},
        "material": {"pinmaterial": "its properties", "pinsteel": "from the list"},
        "material.name": {name: _steel(name) for name in pin.CATALOGUE},
        "load": {"load": "a force", "run": "stored run of crank dynamics"},
        "criterion": {
            "tresca_paper": "Tresca, of bending and mean shear",
            "fibre": "bending of the outer fibre alone",
            "saint_venant": "Saint-Venant, both at their worst places",
        },
        "form.kind": {
            "free": "free: turned to any curve",
            "drillable": "free, but narrowing from the ends to the middle only",
            "constant": "one diameter all along",
            "stepped": "bored in steps",
            "double_cone": "two cones that meet in the middle",
            "cone_cylinder": "cones and a cylinder between them",
        },
    },
    when={
        "geometry.outer_diameter_mm": "variable=bore|given=one",
        "bore_mm": "variable=outer|given=one",
        "form.steps": "form.kind=stepped",
    },
    columns={
        "profile": {
            "bore": (("x_mm", "bore_mm"), "given=points&variable=bore"),
            "outer": (("x_mm", "outer_diameter_mm"), "given=points&variable=outer"),
        }
    },
    only={"form": "design"},
    starts={"material": {"pinsteel": {"name": "pin-steel-16MnCr5"}}},
    sliders=frozenset({"bore_mm", "geometry.outer_diameter_mm", "load.force_n"}),
)
