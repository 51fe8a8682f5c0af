"""Plots of a crank mechanism's cycle: pressure and forces over the angle, polar diagram of the crank-pin load, and
errors of the two-harmonic approximation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from app.designs.pictures.chart import (
    BLUE,
    BOTTOM,
    GREEN,
    GREY,
    HEIGHT,
    LEFT,
    RED,
    RIGHT,
    TOP,
    WIDTH,
    Chart,
    Degrees,
    Linear,
    Say,
    around,
    noted,
)
from app.designs.units import figures
from solvers.crank.motion.slider_crank import ExactMotion, brix_displacement, two_harmonic_acceleration


def _closed(values: Sequence[float]) -> list[float]:
    return [*values, values[0]]


def _angles(run: dict[str, Any]) -> tuple[list[float], float]:
    angles, period = run["result"]["series"]["angle_deg"], 180.0 * run["spec"]["cylinder"]["strokes"]
    return [*angles, period], period


def pressure_over_angle(run: dict[str, Any], say: Say = str) -> str:
    """SVG of p(phi), exact and by Brix's construction, with the dead centres."""
    series, (angles, period) = run["result"]["series"], _angles(run)
    pressure, brix = _closed(series["pressure_mpa"]), series["brix_pressure_mpa"]
    scale = around(pressure)
    legend = [(say("exact"), BLUE), *([(say("by Brix's construction"), RED)] if brix is not None else [])]
    title, x_label, y_label = say("Pressure over the crank angle"), say("crank angle, °"), say("pressure, MPa")
    chart = Chart(title, Degrees(0.0, period), scale, x_label, y_label, legend=legend)
    for jump in run["result"]["dead_centre_jumps"]:
        chart.line([jump["angle_deg"]] * 2, [scale.low, scale.high], GREY, dashes="2 4")
    if brix is not None:
        chart.line(angles, _closed(brix), RED, dashes="5 3")
    chart.line(angles, pressure, BLUE)
    return chart.svg()


def indicator_diagram(run: dict[str, Any], say: Say = str) -> str:
    """SVG of pressure over the volume of the cylinder, from the clearance volume on."""
    spec, series = run["spec"], run["result"]["series"]
    m, cylinder = spec["mechanism"], spec["cylinder"]
    angles, _ = _angles(run)
    motion = ExactMotion(m["crank_radius_mm"], m["rod_length_mm"], m["offset_mm"])
    moved = motion.displacement(np.radians(angles))
    area = 0.25 * np.pi * cylinder["bore_mm"] ** 2
    volume = (cylinder["clearance_volume_cm3"] + 1e-3 * area * moved).tolist()
    pressure = _closed(series["pressure_mpa"])
    crankcase = cylinder["crankcase_pressure_mpa"]
    x, y = around([0.0, *volume]), around([*pressure, crankcase])
    chart = Chart(say("Indicator diagram"), x, y, say("volume, cm³"), say("pressure, MPa"))
    chart.line([x.low, x.high], [crankcase, crankcase], GREY, dashes="6 4")
    chart.words(x.low + 0.62 * (x.high - x.low), crankcase, say("crankcase"), GREY)
    chart.area(volume, pressure, BLUE)
    chart.line(volume, pressure, BLUE)
    return chart.svg()


def torque_over_angle(run: dict[str, Any], say: Say = str) -> str:
    """SVG of one cylinder's torque on the crank, and its mean."""
    (angles, period), torque = _angles(run), _closed(run["result"]["series"]["torque_nm"])
    mean = run["result"]["mean_torque_nm"]
    chart = Chart(
        say("Torque over the crank angle"),
        Degrees(0.0, period),
        around([*torque, 0.0]),
        say("crank angle, °"),
        say("torque, N·m"),
    )
    chart.line([0.0, period], [0.0, 0.0], GREY, dashes="2 4")
    chart.line([0.0, period], [mean, mean], RED, dashes="6 4")
    chart.words(0.02 * period, mean, say("mean {} N·m").format(figures(mean)), RED)
    chart.line(angles, torque, BLUE)
    return chart.svg()


_FORCES = (
    ("gas_force_n", noted("gas"), GREY),
    ("inertia_force_n", noted("inertia"), GREEN),
    ("side_force_n", noted("side"), RED),
    ("tangential_force_n", noted("tangential"), BLUE),
)


def forces_over_angle(run: dict[str, Any], say: Say = str) -> str:
    """SVG of gas, inertia, side and tangential force over the cycle."""
    series, (angles, period) = run["result"]["series"], _angles(run)
    columns = [[value / 1e3 for value in _closed(series[name])] for name, _, _ in _FORCES]
    scale = around(value for column in columns for value in column)
    legend = [(say(words), color) for _, words, color in _FORCES]
    title, x_label, y_label = say("Forces over the crank angle"), say("crank angle, °"), say("force, kN")
    chart = Chart(title, Degrees(0.0, period), scale, x_label, y_label, legend=legend)
    for column, (_, _, color) in zip(columns, _FORCES, strict=True):
        chart.line(angles, column, color)
    return chart.svg()


def crank_pin_polar(run: dict[str, Any], say: Say = str) -> str:
    """SVG of the load on the crank pin, seen from the crank: tangential across, away from the shaft upwards."""
    result, series = run["result"], run["result"]["series"]
    mechanism = run["spec"]["mechanism"]
    speed = 6.283185307179586 * mechanism["speed_hz"]
    outward = result["rod_mass_at_crank_kg"] * mechanism["crank_radius_mm"] / 1e3 * speed**2
    across = [value / 1e3 for value in _closed(series["tangential_force_n"])]
    up = [(outward - value) / 1e3 for value in _closed(series["radial_force_n"])]
    # Equal scales on both axes, so that directions are true.
    plot_width, plot_height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM
    tall = around([*up, 0.0])
    wide = around([*across, 0.0])
    step = max((tall.high - tall.low) / plot_height, (wide.high - wide.low) / plot_width)
    x_mid, y_mid = 0.5 * (wide.low + wide.high), 0.5 * (tall.low + tall.high)
    halves = ((x_mid, 0.5 * plot_width * step), (y_mid, 0.5 * plot_height * step))
    x, y = (Linear(mid - half, mid + half) for mid, half in halves)
    chart = Chart(
        say("Load on the crank pin, turning with the crank"),
        x,
        y,
        say("tangential, kN"),
        say("away from the shaft, kN"),
    )
    chart.line(across, up, BLUE)
    chart.mark(0.0, 0.0, "", GREY)
    worst = next(w for w in result["worst"] if w["name"] == "crank_pin_load_max")
    nearest = min(range(len(across)), key=lambda i: -(across[i] ** 2 + up[i] ** 2))
    chart.mark(
        across[nearest],
        up[nearest],
        say("{} kN at {}°").format(figures(worst["force_n"] / 1e3, 3), f"{worst['angle_deg']:.0f}"),
        RED,
    )
    return chart.svg()


def two_harmonic_effect(run: dict[str, Any], say: Say = str) -> str:
    """SVG of the errors of Brix's construction and the two-harmonic acceleration over the cycle, in per cent.

    Displacement relative to the crank radius, acceleration to its maximum, pressure (if unrolled from a diagram) to its
    maximum; all for the mechanism without offset.
    """
    series, (angles, period) = run["result"]["series"], _angles(run)
    mechanism = run["spec"]["mechanism"]
    r, length = mechanism["crank_radius_mm"], mechanism["rod_length_mm"]
    phi = np.radians(angles)
    motion = ExactMotion(r, length)
    moved = (brix_displacement(phi, r, length) - motion.displacement(phi)) / r
    acceleration_error = two_harmonic_acceleration(phi, r, length, 1.0) - motion.acceleration(phi)
    columns = [
        (noted("displacement"), BLUE, (100.0 * moved).tolist()),
        (noted("acceleration"), GREEN, (100.0 * acceleration_error / (r * (1.0 + r / length))).tolist()),
    ]
    if series["brix_pressure_mpa"] is not None:
        greatest = max(abs(p) for p in series["pressure_mpa"]) or 1.0
        pairs = zip(series["brix_pressure_mpa"], series["pressure_mpa"], strict=True)
        columns.append((noted("pressure"), RED, _closed([100.0 * (brix - exact) / greatest for brix, exact in pairs])))
    scale = around(value for _, _, column in columns for value in column)
    title, legend = say("Error of the two-harmonic formulas"), [(say(words), color) for words, color, _ in columns]
    chart = Chart(title, Degrees(0.0, period), scale, say("crank angle, °"), say("error, %"), legend=legend)
    for _, color, column in columns:
        chart.line(angles, column, color)
    return chart.svg()


PLOTS = {
    "indicator-diagram": indicator_diagram,
    "pressure-over-angle": pressure_over_angle,
    "forces-over-angle": forces_over_angle,
    "torque-over-angle": torque_over_angle,
    "crank-pin-polar": crank_pin_polar,
    "two-harmonic-effect": two_harmonic_effect,
}
