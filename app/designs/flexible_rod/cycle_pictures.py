"""Plots of a strip over the cycle: forces, and fibre stresses over the angle and along the strip."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.designs.flexible_rod.request import CheckRequest
from app.designs.pictures.chart import BLUE, GREEN, GREY, RED, Chart, Degrees, Linear, Say, around
from app.designs.units import MEGA, MILLI, figures, quantity, shown_as
from solvers.effects import EffectSelection
from solvers.rod.cycle.bent_strip import BentStrip
from solvers.rod.cycle.composition import Cycle
from solvers.rod.effects import choose_for, compose

_TURN = Degrees(0.0, 360.0)
_ANGLES, _STATIONS = 361, 61


def has_stresses(run: dict[str, Any]) -> bool:
    """Whether the strip is stable; a buckled one has no shape to plot."""
    return run["result"]["stress_amplitude_mpa"] is not None


def request_of(run: dict[str, Any]) -> CheckRequest:
    """The check of the run's strip."""
    spec = {name: value for name, value in run["spec"].items() if name in CheckRequest.model_fields}
    return CheckRequest.model_validate({**spec, "dimensions": run["result"]["dimensions"]})


def settled(run: dict[str, Any]) -> EffectSelection:
    """Exactly the effects of the run."""
    active = frozenset(effect["name"] for effect in run["effects"] if effect["state"] == "active")
    return EffectSelection(active, frozenset(effect["name"] for effect in run["effects"]) - active)


def _turn(run: dict[str, Any]) -> tuple[CheckRequest, BentStrip]:
    """The check of the run's strip, and its cycle."""
    request = request_of(run)
    choice = choose_for(request.scene(), request.strip(), settled(run), request.effect_tolerance)
    cycle = Cycle(request.scene(), request.strip(), compose(choice), tolerance=1e-4)
    return request, cycle.at(np.radians(np.linspace(0.0, 360.0, _ANGLES)))


def _fibres(turn: BentStrip, stations: np.ndarray) -> np.ndarray:
    """Stresses [MPa] of both fibres, of shape (2, stations, angles)."""
    return turn.fibre_stresses(stations) / MEGA


def forces_over_angle(run: dict[str, Any], say: Say = str) -> str:
    """SVG of the axial force in the strip and the side force on the piston, with the critical compression."""
    _, turn = _turn(run)
    angles = np.degrees(turn.angle).tolist()
    axial, side = turn.force.tolist(), turn.side_force().tolist()
    critical = -run["result"]["critical_force_n"]
    scale = around([*axial, *side, 0.0])
    if critical > scale.low - 0.5 * (scale.high - scale.low):
        scale = around([*axial, *side, 0.0, critical])
    legend = [(say("axial force in the strip, tension positive"), BLUE), (say("side force on the piston"), RED)]
    chart = Chart(say("Forces over the cycle"), _TURN, scale, say("crank angle, °"), say("force, N"), legend=legend)
    chart.line([0.0, 360.0], [0.0, 0.0], GREY, dashes="2 4")
    if critical >= scale.low:
        chart.line([0.0, 360.0], [critical, critical], GREY, dashes="6 4")
        chart.words(4.0, critical, say("buckles"), GREY)
    chart.line(angles, axial, BLUE)
    chart.line(angles, side, RED)
    return chart.svg()


def stresses_over_angle(run: dict[str, Any], say: Say = str) -> str:
    """SVG of both fibres' stresses at the governing section, with mean and amplitude of the worse one."""
    _, turn = _turn(run)
    result = run["result"]
    section = result["worst_section_mm"] * MILLI
    upper, lower = (fibre[0].tolist() for fibre in _fibres(turn, np.array([section])))
    angles = np.degrees(turn.angle).tolist()
    mean, amplitude = result["stress_mean_mpa"], result["stress_amplitude_mpa"]
    governs = result["worst_fibre"] or 1
    names = [say("fibre on the outer side, +h/2"), say("fibre on the inner side, −h/2")]
    legend = [
        (say("{}, which governs").format(name) if governs == sign else name, color)
        for name, sign, color in zip(names, (1, -1), (BLUE, GREEN), strict=True)
    ]
    title = say("Stresses at {} from the clamp").format(quantity(result["worst_section_mm"], "mm", 4))
    scale = around([*upper, *lower, mean - amplitude, mean + amplitude])
    chart = Chart(title, _TURN, scale, say("crank angle, °"), say("stress, MPa"), legend=legend)
    chart.area([0.0, 360.0, 360.0, 0.0], [mean - amplitude] * 2 + [mean + amplitude] * 2, GREY)
    chart.line([0.0, 360.0], [mean, mean], GREY, dashes="6 4")
    size = shown_as("MPa")[1]
    chart.words(4.0, mean, f"{figures(mean / size)} ± {figures(amplitude / size)}", GREY)
    chart.line(angles, upper, BLUE)
    chart.line(angles, lower, GREEN)
    return chart.svg()


def stress_along_strip(run: dict[str, Any], say: Say = str) -> str:
    """SVG of the minimum and maximum stress over the cycle along the strip, and the section governing fatigue."""
    request, turn = _turn(run)
    length = request.strip().l
    stations = np.linspace(0.0, length, _STATIONS)
    places = (stations / MILLI).tolist()
    fibres = _fibres(turn, stations)
    bands = [(fibre.min(axis=1).tolist(), fibre.max(axis=1).tolist()) for fibre in fibres]
    scale = around([0.0, *(value for band in bands for edge in band for value in edge)])
    legend = [(say("fibre on the outer side"), BLUE), (say("fibre on the inner side"), GREEN)]
    chart = Chart(
        say("Stresses along the strip"),
        Linear(0.0, places[-1]),
        scale,
        say("from the clamp, mm"),
        say("stress, MPa"),
        legend=legend,
    )
    for (low, high), color in zip(bands, (BLUE, GREEN), strict=True):
        chart.area([*places, *reversed(places)], [*low, *reversed(high)], color)
        chart.line(places, low, color)
        chart.line(places, high, color)
    worst = run["result"]["worst_section_mm"]
    chart.line([worst, worst], [scale.low, scale.high], RED, dashes="4 3")
    chart.words(worst + 0.01 * places[-1], scale.low, say("fatigue governs here"), RED)
    return chart.svg()
