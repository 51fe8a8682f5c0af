"""Plots of a pin: bore to scale, internal forces, stress, and profiles over the load."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from app.designs.drawing import worded
from app.designs.pictures.chart import BLUE, GREEN, GREY, RED, Chart, Linear, Say, around, opening, stacked
from app.designs.pictures.drawing_svg import drawing_alone
from app.designs.pin_profile.drawing import in_machine
from app.designs.pin_profile.request import DesignRequest, material_of
from app.designs.units import MEGA, figures, quantity
from solvers import pin

_WIDTH = 520.0
_LOADS = (0.25, 0.5, 0.75, 0.9, 0.99)
_PLACES = 121
_OUTSIDE_LOADS = (0.25, 0.5, 1.0, 2.0)


def _columns(run: dict[str, Any], *names: str) -> list[list[float]]:
    rows = run["result"]["profile"]
    return [[row[name] for row in rows] for name in names]


def bore_picture(run: dict[str, Any], say: Say = str) -> str:
    """SVG of the part's axial section to scale, between bosses and small end."""
    return drawing_alone(worded(in_machine(run), say))


def forces_picture(run: dict[str, Any], say: Say = str) -> str:
    """SVG of bending moment and shear force along the pin, stacked, each in its unit."""
    x, moment, shear = _columns(run, "x_mm", "moment_nmm", "shear_n")
    along = Linear(0.0, x[-1])
    tables = (
        ([value / 1e3 for value in moment], say("moment M, N·m"), BLUE),
        ([value / 1e3 for value in shear], say("shear Q, kN"), RED),
    )
    charts = []
    for values, words, color in tables:
        chart = Chart(words, along, around([0.0, *values]), say("x, mm"), words, height=230)
        chart.line([0.0, x[-1]], [0.0, 0.0], GREY, dashes="2 4")
        chart.area([0.0, *x, x[-1]], [0.0, *values, 0.0], color)
        chart.line(x, values, color)
        charts.append(chart)
    return stacked(say("Bending moment and shear force along the axis"), charts)


def has_ring(run: dict[str, Any]) -> bool:
    return run["result"]["ring_stresses_mpa"] is not None


def ring_picture(run: dict[str, Any], say: Say = str) -> str:
    """SVG of the pin's middle cross-section, round and ovalized (greatly exaggerated), with the hoop stresses at four
    points."""
    result = run["result"]
    stresses = result["ring_stresses_mpa"]
    outer, bore = result["outer_mid_mm"], result["bore_mid_mm"]
    wide, high, middle = _WIDTH, 340.0, (0.5 * _WIDTH, 170.0)
    scale = 100.0 / (0.5 * outer)
    squeeze = 12.0 / scale  # exaggerated change of radius, the same for every pin
    out = [opening(say("Hoop stress of the ring in the middle"), wide, high)]
    turn = [2.0 * math.pi * n / 120 for n in range(120)]

    def ring(radius: float, by: float) -> str:
        points = [(radius + by * math.cos(2.0 * a)) * scale for a in turn]
        places = (
            f"{middle[0] + r * math.cos(a):.1f},{middle[1] + r * math.sin(a):.1f}"
            for a, r in zip(turn, points, strict=True)
        )
        return "M" + "L".join(places) + "Z"

    pressed = ring(0.5 * outer, squeeze) + ring(0.5 * bore, squeeze)
    out.append(f'<path d="{pressed}" fill="{BLUE}" fill-opacity="0.25" fill-rule="evenodd" stroke="{BLUE}"/>')
    for radius in (0.5 * outer, 0.5 * bore):
        out.append(f'<path d="{ring(radius, 0.0)}" fill="none" stroke="{GREY}" stroke-dasharray="4 4"/>')
    for down in (-1.0, 1.0):
        begin, end = middle[1] + down * 152.0, middle[1] + down * 106.0
        out.append(
            f'<path d="M{middle[0]:.0f},{begin:.0f}V{end:.0f}m-6,{8 * down:.0f}l6,{-8 * down:.0f}l6,{8 * down:.0f}" '
            f'fill="none" stroke="{RED}" stroke-width="2.5"/>'
        )
    right = middle[0] + 124.0
    fibres = (
        (say("under the load"), "outer_top", "inner_top", 40.0),
        (say("at the side"), "outer_side", "inner_side", 152.0),
    )
    for words, outside, inside, top in fibres:
        lines = (
            words,
            say("outside {}").format(_signed(stresses[outside])),
            say("inside {}").format(_signed(stresses[inside])),
        )
        for row, line in enumerate(lines):
            out.append(f'<text x="{right:.0f}" y="{top + 18 * row:.0f}" fill="currentColor">{line}</text>')
    if result["ovalization_um"] is not None:
        exaggerated = say("drawn exaggerated")
        oval = say("ovalized by {}").format(quantity(result["ovalization_um"], "µm", 4))
        out.append(
            f'<text x="16" y="40" fill="currentColor">{oval}</text>'
            f'<text x="16" y="58" fill="{GREY}">{exaggerated}</text>'
        )
    return "".join(out) + "</svg>"


def _signed(value: float) -> str:
    return ("+" if value > 0.0 else "") + quantity(value, "MPa", 4)


def stress_picture(run: dict[str, Any], say: Say = str) -> str:
    """SVG of equivalent and allowable stress along the pin."""
    rows = [row for row in run["result"]["profile"] if row["equivalent_stress_mpa"] is not None]
    x, stress = [row["x_mm"] for row in rows], [row["equivalent_stress_mpa"] for row in rows]
    allowable = material_of(run["spec"]).allowable_stress / MEGA
    chart = Chart(
        say("Equivalent stress"),
        Linear(0.0, run["result"]["profile"][-1]["x_mm"]),
        Linear(0.0, 1.08 * max(allowable, *stress)),
        say("x, mm"),
        say("equivalent stress, MPa"),
    )
    chart.line([0.0, x[-1]], [allowable, allowable], RED, dashes="6 4")
    chart.words(0.02 * x[-1], allowable, say("allowable"), RED)
    chart.line(x, stress, BLUE)
    return chart.svg()


def load_family(run: dict[str, Any], say: Say = str) -> str:
    """SVG of free profiles over the load (figure 5 of the paper) and of this pin: diameter over half the length."""
    spec = {name: value for name, value in run["spec"].items() if name in DesignRequest.model_fields}
    if run["spec"]["variable"] == "bore":
        spec["bore_mm"] = None
    request = DesignRequest.model_validate({**spec, "form": {"kind": "free"}})
    scene, force, criterion = request.scene(), request.load.force, pin.CRITERIA[request.criterion]
    if request.seeks_outside:
        sought, forces = "outer_diameter_mm", [share * force for share in _OUTSIDE_LOADS]
        title, words = say("Outsides over the load"), say("outer diameter, mm")
    else:
        sought, forces = "bore_mm", [share * pin.force_limit(scene, criterion) for share in _LOADS]
        title, words = say("Profiles over the load"), say("bore, mm")
    half, g = 0.5e3 * scene.geometry.length, scene.geometry
    x = np.unique([*np.linspace(0.0, 0.5 * g.length, _PLACES), g.boss_length, g.boss_length + g.gap])
    profiles = [1e3 * pin.free_sizes(scene, criterion, own_force, x) for own_force in forces]
    places, own = _columns(run, "x_mm", sought)
    top = max(max(own), *(float(diameter.max()) for diameter in profiles))
    chart = Chart(title, Linear(0.0, half), Linear(0.0, 1.05 * top), say("x, mm"), words)
    for own_force, diameter in zip(forces, profiles, strict=True):
        chart.line(list(1e3 * x), list(diameter), GREY)
        chart.words(0.8 * half, float(diameter[-1]), say("{} kN").format(figures(own_force / 1e3, 3)), GREY)
    mine = [(p, d) for p, d in zip(places, own, strict=True) if p <= half * (1.0 + 1e-9)]
    chart.line([p for p, _ in mine], [d for _, d in mine], GREEN)
    chart.words(0.02 * half, 0.0, say("green: this one, {} kN").format(figures(force / 1e3)), GREEN)
    return chart.svg()
