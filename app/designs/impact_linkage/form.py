"""Wording and layout of the linkage's forms."""

from typing import Any

from app.designs.form import FormWords, Switch

_TYPES = {
    "largest_coupler": "longest link: the coupler",
    "largest_rocker": "longest link: the rocker",
    "largest_base": "longest link: the base",
}


def _given(request: dict[str, Any]) -> str:
    lengths = request.get("lengths_mm") or {}
    return "lengths" if any(value is not None for value in lengths.values()) else "ratio"


FORM = FormWords(
    sections={
        "The blow": ("restitution", "blow_frequency_hz", "impact_speed_m_s", "impact_energy_j", "tool_radius_mm"),
        "Linkage": ("type", "ratios", "lengths_mm", "types"),
        "Objective": ("objective", "front"),
        "Room and limits": ("limits",),
        "Drive, elasticity, tolerances": ("drive", "coupler_stiffness_n_m", "length_tolerance_mm"),
    },
    switches={
        "given": Switch(
            "What is known of the linkage",
            {"ratio": "its type and free ratio", "lengths": "its four lengths"},
            _given,
            "Linkage",
            "check",
        )
    },
    labels={
        "restitution": "Restitution of what is struck",
        "restitution.low": "Restitution, least",
        "restitution.high": "Restitution, greatest",
        "blow_frequency_hz": "Blows per second",
        "impact_speed_m_s": "Speed of the tool at the blow",
        "impact_energy_j": "Energy of a blow",
        "tool_radius_mm": "Radius on which the tool moves",
        "type": "Type",
        "types": "Types allowed",
        "ratios": "",
        "lengths_mm": "",
        "ratios.lambda0": "Base/crank λ₀",
        "ratios.lambda2": "Coupler/crank λ₂",
        "objective": "Objective",
        "front": "Trade-off against another quantity",
        "front.against": "Other quantity",
        "front.points": "Points of the trade-off",
        "limits.min_link_mm": "Links, at least",
        "limits.joint_radius_mm": "Radius of the joints",
        "limits.longest_link_mm": "Longest link, at most",
        "limits.width_mm": "Width of the box, at most",
        "limits.height_mm": "Height of the box, at most",
        "limits.enclosing_radius_mm": "Radius of a pipe around it, at most",
        "limits.max_pin_force_n": "Force in the joints, at most",
        "limits.transmission_angle_deg": "Transmission angle in mid-cycle",
        "drive": "A motor drives it",
        "drive.stall_torque_nm": "Torque at standstill",
        "drive.free_speed_hz": "Speed without load",
        "drive.crank_inertia_kg_m2": "Inertia of crank and flywheel",
        "coupler_stiffness_n_m": "Stiffness of the coupler, if it is elastic",
        "length_tolerance_mm": "Tolerance of the lengths",
    },
    helps={
        "blow_frequency_hz": "one per revolution of the crank",
        "restitution": "0.05 is nearly dead, 0.95 nearly elastic",
        "limits.width_mm": "of the swept area",
        "limits.height_mm": "of the swept area",
        "limits.min_link_mm": "",
        "limits.joint_radius_mm": "room that every joint needs on all sides",
        "limits.transmission_angle_deg": "between coupler and rocker",
        "coupler_stiffness_n_m": "",
        "length_tolerance_mm": "",
        "drive.stall_torque_nm": "at the crank",
        "drive.free_speed_hz": "at the crank",
        "type": "",
        "types": "",
        "front.against": "",
        "drive": "torque falls with speed along a straight line",
    },
    options={
        "restitution": {"number": "one value", "restitutionrange": "from … to"},
        "type": {"": "recognised from the lengths", **_TYPES},
        "types": _TYPES,
        "objective": {
            "box_area": "least area of the box around it",
            "longest_link": "least length of the longest link",
            "enclosing_radius": "least radius of a pipe around it",
            "peak_torque": "least peak torque",
            "pin_force": "least force in the joints",
            "impact_speed": "greatest speed at the blow",
            "blow_frequency": "greatest frequency of the blows",
        },
        "front.against": {"none": "none: the best linkage alone"},
    },
    when={
        "ratios": "given=ratio",
        "ratios.lambda0": "type=largest_base",
        "ratios.lambda2": "type=largest_coupler,largest_rocker",
        "lengths_mm": "given=lengths",
        "front.points": "front.against=" + ",".join(
            ("box_area", "longest_link", "enclosing_radius", "peak_torque", "pin_force", "impact_speed",
             "blow_frequency", "height", "width")
        ),
    },
    always=frozenset(
        {"blow_frequency_hz", "impact_speed_m_s", "impact_energy_j", "base", "crank", "coupler", "rocker",
         "stall_torque_nm", "free_speed_hz", "crank_inertia_kg_m2"}
    ),
    sliders=frozenset({"ratios.lambda0", "ratios.lambda2", "impact_speed_m_s", "blow_frequency_hz"}),
)  # fmt: skip
