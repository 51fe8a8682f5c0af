"""Plots of a linkage's cycle: u31, torque and pin force, and the Pareto front."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.designs.pictures.chart import BLUE, GREEN, GREY, RED, Chart, Degrees, Say, around
from app.designs.units import MILLI, figures
from solvers.linkage import KINDS
from solvers.linkage.loads.torque_and_pin_force import series
from solvers.linkage.mechanism.change_point import plain_ratios
from solvers.linkage.mechanism.kinematics import FourBar

_CYCLE = Degrees(0.0, 360.0)
_CLIP = 4.0
"""u31 is unbounded near a dead point; it is clipped at this multiple of its value at the blow."""


def bar_of(result: dict[str, Any]) -> FourBar:
    """The mechanism of a run's result, to plotting precision."""
    ratios = result["ratios"]
    return FourBar(KINDS[result["type"]], plain_ratios(ratios["lambda0"], ratios["lambda2"], ratios["lambda3"]))


def has_transfer(run: dict[str, Any]) -> bool:
    """Whether there is a blow; a batch item may be stored without the curve itself."""
    return run["result"]["u31_start"] is not None


def transfer_picture(run: dict[str, Any], say: Say = str) -> str:
    """SVG of u31 = dphi3/dphi over the crank angle; at the blow it jumps from its end to its start value."""
    result = run["result"]
    phi = [sample["phi_deg"] for sample in result["transfer"]]
    u = [sample["u31"] for sample in result["transfer"]]
    edge = _CLIP * max(abs(u[0]), abs(u[-1]))
    shown = [min(max(value, -edge), edge) for value in u]
    scale = around([*shown, 0.0])
    chart = Chart(say("u31 over the crank angle"), _CYCLE, scale, say("crank angle from the blow, °"), "u31 = dφ₃/dφ")
    chart.line([0.0, 360.0], [0.0, 0.0], GREY, dashes="2 4")
    chart.line([360.0, 360.0], [u[-1], u[0]], RED, dashes="5 3")
    middle = next((i for i in range(1, len(phi)) if phi[i] - phi[i - 1] > 45.0), len(phi))
    for run_of in (slice(0, middle), slice(middle, None)):
        if phi[run_of]:
            chart.line(phi[run_of], shown[run_of])
    chart.mark(0.0, u[0], "", BLUE)
    below = u[0] + (-0.13 if u[0] > 0 else 0.13) * (scale.high - scale.low)
    chart.words(8.0, below, say("after the blow {}").format(f"{u[0]:.4g}"), BLUE)
    chart.mark(360.0, u[-1], say("before the blow {}").format(f"{u[-1]:.4g}"), RED)
    return chart.svg()


def has_loads(run: dict[str, Any]) -> bool:
    return run["result"]["pin_force_n"] is not None


def loads_picture(run: dict[str, Any], say: Say = str) -> str:
    """SVG of crank torque and pin force over the cycle, each relative to its peak."""
    result = run["result"]
    bar, crank = bar_of(result), result["lengths_mm"]["crank"] * MILLI
    degrees = np.linspace(0.0, 360.0, 241)
    torque, force = series(bar, crank, run["spec"]["impact_energy_j"], np.radians(degrees))
    shares = [(torque / result["peak_torque_nm"]).tolist(), (force / result["pin_force_n"]).tolist()]
    chart = Chart(
        say("Loads over the cycle"),
        _CYCLE,
        around([0.0, *shares[0], *shares[1]]),
        say("crank angle from the blow, °"),
        say("share of the peak"),
        legend=[
            (say("crank torque, peak {} N·m").format(figures(result["peak_torque_nm"])), BLUE),
            (say("pin force, peak {} N").format(figures(result["pin_force_n"])), RED),
        ],
    )
    chart.line([0.0, 360.0], [0.0, 0.0], GREY, dashes="2 4")
    for share, color in zip(shares, (BLUE, RED), strict=True):
        chart.line(degrees.tolist(), share, color)
    return chart.svg()


def has_front(run: dict[str, Any]) -> bool:
    found = run["result"].get("front")
    return found is not None and len(found["points"]) > 1


_COLORS = {"largest_coupler": BLUE, "largest_rocker": GREEN, "largest_base": RED}


def front_picture(run: dict[str, Any], say: Say = str) -> str:
    """SVG of the Pareto front, each point in the colour of its type."""
    found = run["result"]["front"]
    across = [point["against"] for point in found["points"]]
    up = [point["objective"] for point in found["points"]]
    labels = [f"{say(found[name].replace('_', ' '))}, {found[name + '_unit']}" for name in ("against", "objective")]
    present = [name for name in _COLORS if any(point["type"] == name for point in found["points"])]
    legend = [(say(name.replace("_", " ")), _COLORS[name]) for name in present]
    chart = Chart(say("Pareto front"), around(across), around(up), *labels, legend=legend)
    chart.line(across, up, GREY, dashes="2 4")
    for point in found["points"]:
        chart.mark(point["against"], point["objective"], "", _COLORS[point["type"]])
    return chart.svg()
