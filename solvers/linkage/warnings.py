"""Warnings about a linkage."""

from __future__ import annotations

import math

from solvers.linkage.result import LinkageCheck
from solvers.linkage.scene import STRENGTH_SPEED, TRANSMISSION, Scene

_LARGE = 100.0
SPEED_SLACK = 1e-3
"""Relative tolerance of the impact speed against the required one."""


def warnings_of(check: LinkageCheck, scene: Scene) -> tuple[str, ...]:
    """Warning messages; empty if there are none."""
    out = []
    mechanism, strike = check.mechanism, check.strike
    bar, confined = mechanism.bar, mechanism.confined
    if check.window is not None:
        out.append(_closure_warning(check))
    if confined is not None:
        out.append(f"the crank cannot turn: it is confined to ±{math.degrees(confined):.1f}° about the blow")
    if strike is None and check.window is None:
        out.append("the links close, but the rocker does not reverse at the blow: this motion cannot strike")
    if strike is None:
        return tuple(out)
    if strike.peaks is not None and strike.peaks.u31 > bar.u31_end * (1 + 1e-9):
        share = strike.peaks.u31 / bar.u31_end
        out.append(f"the rocker is {share:.3f} times as fast in mid-cycle as at the blow")
    if strike.impact_speed > STRENGTH_SPEED * (1 + 1e-9):
        limit = f"{STRENGTH_SPEED:g} m/s, above which striking parts fail early"
        out.append(f"the impact speed of {strike.impact_speed:.3g} m/s exceeds {limit}")
    if abs(strike.impact_speed / scene.impact_speed - 1.0) > SPEED_SLACK:
        asked = f"the {scene.impact_speed:.4g} m/s asked for"
        out.append(f"the tool strikes at {strike.impact_speed:.4g} m/s, not at {asked}")
    nu = float(bar.middle_transmission_angle)
    if mechanism.rotatable and not TRANSMISSION[0] - 1e-9 <= nu <= TRANSMISSION[1] + 1e-9:
        out.append(f"the transmission angle in mid-cycle is {math.degrees(nu):.1f}°, outside the usual 40° to 140°")
    if bar.longest > _LARGE:
        out.append("the longest link exceeds 100 cranks: a limit on the size would give a mechanism that can be built")
    if strike.mismatch > 0.05:
        out.append(f"the restitution may differ by {strike.mismatch:.3g} from the one the mechanism is made for")
    return tuple(out)


def _closure_warning(check: LinkageCheck) -> str:
    mechanism, window = check.mechanism, check.window
    kind = mechanism.bar.kind.name.replace("_", " ")
    surplus = mechanism.closure.surplus * mechanism.crank
    missed = f"the lengths miss the closure of the {kind} by {surplus * 1e3:.4g} mm"
    if window.blocked:
        return f"{missed}: the crank is blocked within ±{math.degrees(window.angle):.3g}° of the blow"
    return f"{missed}: the rocker turns back {math.degrees(window.short_stop):.3g}° short of its place"
