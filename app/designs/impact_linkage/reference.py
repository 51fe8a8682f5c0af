"""Reference solutions of checks and designs of a linkage, from ``solvers.references.linkage``."""

from __future__ import annotations

import math
from collections.abc import Callable

from app.designs.impact_linkage.request import CheckRequest, DesignRequest, LinkageRequest
from app.designs.independent import active, exact, reference
from app.designs.kind import Answer
from solvers import linkage
from solvers.accuracy import Exact, Reference

_SHAPE = {
    "start": "u31_start",
    "end": "u31_end",
    "greatest": "u31_max",
    "restitution": "kinematic_restitution",
    "transmission_angle": "transmission_angle_deg",
}
_SIZE = {"impact_speed": "impact_speed_m_s", "longest": "longest_link_mm", "area": "box_area_mm2"}
_LOADS = {"torque": "peak_torque_nm", "force": "pin_force_n"}


def check_reference(request: CheckRequest, answer: Answer) -> Reference | None:
    """Main results of a check, if the linkage is described by its free ratio and fully rotatable."""
    if request.type is None or request.ratios is None or request.ratios == type(request.ratios)():
        return None
    ratio = getattr(request.ratios, linkage.KINDS[request.type].parameter)
    return _reference(request, request.type, ratio, answer, "")


def design_reference(request: DesignRequest, answer: Answer) -> Reference | None:
    """Main results of a design, for the type and free ratio of its tightest answer."""
    kind = answer.result["type"]
    ratio = answer.result["ratios"][linkage.KINDS[kind].parameter]
    return _reference(request, kind, ratio, answer, ", with the free ratio of the tightest solution")


def _reference(request: LinkageRequest, kind: str, ratio: float, answer: Answer, where: str) -> Reference | None:
    if not answer.result["rotatable"] or answer.result["u31_end"] is None:
        return None
    sized = request.tool_radius_mm is None and request.blow_frequency_hz is not None
    sized = sized and request.impact_speed_m_s is not None
    loaded = request.impact_energy_j is not None
    limits = request.limits.to_solver()
    boxed = sized and "envelope" in active(answer) and limits.width is None and limits.height is None
    restitution = request.range.middle

    def results(watch: Callable[[], None]) -> dict[str, Exact]:
        # imported here because only studies need arbitrary precision
        from solvers.references.linkage import box_area, strike

        found = strike(kind, restitution, ratio, loaded, watch)
        names = dict(_SHAPE)
        if loaded:
            names["torque"] = _LOADS["torque"]
            found["torque"] = _times(found["torque"], request.impact_energy_j)
        if sized:
            scene = request.scene()
            crank = scene.impact_speed / (2 * math.pi * scene.blow_frequency * found["rocker"][0] * found["end"][0])
            names |= {name: _SIZE[name] for name in ("impact_speed", "longest")}
            found["impact_speed"] = (scene.impact_speed, 0.0)
            found["longest"] = _times(found["longest"], crank)
            if loaded:
                names["force"] = _LOADS["force"]
                found["force"] = _times(found["force"], request.impact_energy_j / crank)
            if boxed:
                names["area"] = _SIZE["area"]
                area = box_area(kind, restitution, ratio, limits.joint_radius / crank, watch)
                found["area"] = (area * crank**2, _DIVIDED)
        return exact(found, names)

    return reference(f"circles that intersect, velocities of the joints{where}", results)


_DIVIDED = 8 * 2.0**-52
"""Rounding error of a few operations on the sizes."""


def _times(found: tuple[object, float], factor: object) -> tuple[object, float]:
    value, doubt = found
    return value * factor, doubt + _DIVIDED
