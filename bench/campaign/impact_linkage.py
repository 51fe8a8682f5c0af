"""Random impact linkages of the three types, above the minimum free ratio at which the crank can rotate."""

from __future__ import annotations

from typing import Any

import numpy as np

from solvers.linkage import KINDS
from solvers.linkage.mechanism.change_point import Gain


def request(rng: np.random.Generator) -> dict[str, Any]:
    """A check request; one in four is hard: close to the minimum ratio, or a nearly plastic or elastic impact."""
    hard = rng.random() < 0.25
    restitution = float(
        rng.choice([10 ** rng.uniform(-4, -2), rng.uniform(0.8, 0.94)]) if hard else rng.uniform(0.05, 0.7)
    )
    name = str(rng.choice(list(KINDS)))
    kind = KINDS[name]
    beyond = 10 ** (rng.uniform(-4.0, -1.5) if hard else rng.uniform(-1.5, 1.0))
    free = kind.parameter_limit(Gain(restitution)) * (1.0 + beyond)
    body: dict[str, Any] = {
        "restitution": restitution,
        "blow_frequency_hz": 10 ** rng.uniform(0.0, 2.0),
        "impact_speed_m_s": 10 ** rng.uniform(0.0, 1.0),
        "impact_energy_j": 10 ** rng.uniform(-1.0, 2.5),
        "type": name,
        "ratios": {kind.parameter: free},
        "limits": {"joint_radius_mm": float(rng.choice([0.0, rng.uniform(1.0, 10.0)])), "transmission_angle_deg": None},
    }
    if rng.random() < 0.5:
        speed = body["blow_frequency_hz"] * rng.uniform(1.02, 1.3)
        power = body["impact_energy_j"] * body["blow_frequency_hz"]
        body["drive"] = {
            "stall_torque_nm": power / speed * 10 ** rng.uniform(0.5, 1.5),
            "free_speed_hz": speed,
            "crank_inertia_kg_m2": body["impact_energy_j"] / (6.28 * speed) ** 2 * 10 ** rng.uniform(1.0, 3.0),
        }
    if rng.random() < 0.5:
        body["coupler_stiffness_n_m"] = 10 ** rng.uniform(6.0, 9.0)
    if rng.random() < 0.5:
        body["length_tolerance_mm"] = 10 ** rng.uniform(-3.0, -1.0)
    if rng.random() < 0.5:
        # a range around the design restitution, most of whose blows mismatch
        half = min(restitution - 1e-4, 0.95 - restitution) * 10 ** rng.uniform(-6.0, 0.0)
        body["restitution"] = {"low": restitution - half, "high": restitution + half}
    return body


def shares(result: dict[str, Any]) -> dict[str, float]:
    """1 + elastic peak / pin force, and 1 + restitution error; both 1 if absent, i.e. negligible."""
    peak, force = result.get("coupler_peak_n"), result.get("pin_force_n")
    return {
        "1 + coupler_peak/pin_force": 1.0 + (peak / force if peak and force else 0.0),
        "1 + restitution_error": 1.0 + (result.get("restitution_error") or 0.0),
    }
