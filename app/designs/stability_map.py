"""The paper's Fig. 2 with the design on it: critical parameter over free length, as SVG."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from solvers.rod.stability import critical_parameter

WIDTH, HEIGHT = 560, 380
LEFT, RIGHT, TOP, BOTTOM = 64, 20, 20, 52
BETA = (0.1, 1.0)
PARAMETER = (0.0, 16.0)


def _x(beta: float) -> float:
    return LEFT + (beta - BETA[0]) / (BETA[1] - BETA[0]) * (WIDTH - LEFT - RIGHT)


def _y(parameter: float) -> float:
    clipped = min(max(parameter, PARAMETER[0]), PARAMETER[1])
    return HEIGHT - BOTTOM - (clipped - PARAMETER[0]) / (PARAMETER[1] - PARAMETER[0]) * (HEIGHT - TOP - BOTTOM)


def _path(beta: np.ndarray, parameter: np.ndarray) -> str:
    return "M" + "L".join(f"{_x(b):.1f},{_y(p):.1f}" for b, p in zip(beta, parameter, strict=True))


def stability_map(run: dict[str, Any]) -> str:
    """SVG of u = L sqrt(P/EI) over l/L: the boundary, and the run's strip under its greatest compression."""
    result, spec = run["result"], run["spec"]
    ratio = result["dimensions"]["l_mm"] / spec["mechanism"]["rod_length_mm"]
    beta = np.linspace(*BETA, 181)
    boundary = critical_parameter(beta)
    safety = result["stability_safety"]
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" class="plot" '
        'font-family="system-ui, sans-serif" font-size="13">',
        "<title>Stability map: the strip against its buckling boundary</title>",
        f'<path d="{_path(beta, boundary)}L{_x(1):.1f},{_y(99):.1f}L{_x(BETA[0]):.1f},{_y(99):.1f}Z" '
        'fill="#b3261e" fill-opacity="0.10"/>',
        f'<path d="{_path(beta, boundary)}" fill="none" stroke="#b3261e" stroke-width="2"/>',
    ]
    for tick in np.arange(0.1, 1.01, 0.1):
        out.append(
            f'<text x="{_x(tick):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle" '
            f'fill="currentColor">{tick:.1f}</text>'
        )
    for tick in range(0, 17, 4):
        out.append(
            f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{_y(tick):.1f}" y2="{_y(tick):.1f}" stroke="currentColor" '
            'stroke-opacity="0.15"/>'
            f'<text x="{LEFT - 8}" y="{_y(tick) + 4:.1f}" text-anchor="end" fill="currentColor">{tick}</text>'
        )
    out.append(
        f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 10}" text-anchor="middle" fill="currentColor">'
        "free length / rod length</text>"
        f'<text transform="translate(18 {(HEIGHT - BOTTOM + TOP) / 2}) rotate(-90)" text-anchor="middle" '
        'fill="currentColor">L √(P/EI)</text>'
        f'<text x="{_x(0.62):.1f}" y="{_y(11):.1f}" fill="#b3261e">buckles</text>'
    )
    if safety is not None and ratio >= BETA[0]:
        # P goes with the square of u, so the strip stands at u_cr/sqrt(n).
        parameter = float(critical_parameter(min(ratio, 1.0))) / math.sqrt(safety)
        x, y = _x(ratio), _y(parameter)
        out.append(
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y:.1f}" y2="{_y(float(critical_parameter(min(ratio, 1.0)))):.1f}" '
            'stroke="#1a5fb4" stroke-dasharray="4 3"/>'
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="#1a5fb4"/>'
            f'<text x="{x + 12:.1f}" y="{y + 4:.1f}" fill="#1a5fb4">n = {safety:.3g}</text>'
        )
    out.append("</svg>")
    return "".join(out)
