"""The crank as a textbook writes it: differences of lengths, arccosines, a table of even angles."""

from __future__ import annotations

import mpmath as mp
import numpy as np

from solvers.references.crank import Machine

ANGLES = 720


def motion(inputs):
    """The values of a motion case by name: x = H - r cos(phi) - sqrt(L^2 - (r sin(phi) - e)^2) and its derivatives."""
    r, length, e = (np.float64(inputs[name]) for name in ("crank_radius", "rod_length", "offset"))
    height = np.sqrt((length + r) ** 2 - e**2)
    found = {}
    with np.errstate(all="ignore"):
        if "angle" in inputs:
            phi = np.float64(inputs["angle"])
            s = (r * np.sin(phi) - e) / length
            beta = np.arcsin(s)
            turning = r * np.cos(phi) / (length * np.cos(beta))
            bending = -r * np.sin(phi) / (length * np.cos(beta)) + turning**2 * np.tan(beta)
            found |= {
                "displacement": height - r * np.cos(phi) - length * np.cos(beta),
                "velocity": r * np.sin(phi + beta) / np.cos(beta),
                "acceleration": r * np.cos(phi) + length * (bending * np.sin(beta) + turning**2 * np.cos(beta)),
                "rod_tangent": np.tan(beta),
                "rod_angular_acceleration": bending,
            }
        if "position" in inputs:
            x = np.float64(inputs["position"])
            d = np.sqrt((height - x) ** 2 + e**2)
            found["crank_angle"] = np.arctan(e / (height - x)) + np.arccos((r**2 + d**2 - length**2) / (2 * r * d))
    return {name: float(value) for name, value in found.items()}


def pendulum(inputs):
    """The values of a pendulum case by name, the amplitude by the series' first two terms."""
    x = {name: np.float64(value) for name, value in inputs.items()}
    theta = x["amplitude"]
    late = 1 + theta**2 / 16 + 11 * theta**4 / 3072
    a, b = (x["gravity"] * (x[f"period_{end}_end"] / late) ** 2 / (4 * np.pi**2) for end in ("small", "big"))
    pivots, mass = x["pivot_distance"], x["rod_mass"]
    with np.errstate(all="ignore"):
        arm = pivots * (b - pivots) / (a + b - 2 * pivots)
        cg = arm - x["small_end_bore_radius"]
        length = pivots - x["small_end_bore_radius"] - x["big_end_bore_radius"]
        inertia = mass * a * arm - mass * arm**2
        return {
            "rod_cg_from_pin": float(cg),
            "rod_mass_at_pin": float(mass * (length - cg) / length),
            "rod_mass_at_crank": float(mass * cg / length),
            "rod_inertia": float(inertia),
        }


def cycle(scene):
    """Worst forces and power of a cycle case by name, from even angles, with the 53 bits of a float."""
    with mp.workdps(15):
        machine = Machine(scene)
        period = machine.gas.period
        step = period / ANGLES
        rows = [machine.forces(machine.gas.breaks[0] + k * step) for k in range(ANGLES)]
        found = {name: max(row[name][0] for row in rows) for name in rows[0] if name != "torque"}
        work = mp.fsum(row["torque"][0] for row in rows) * step
        found["torque_mean"] = work / period
        found["indicated_power"] = work * machine.x["speed"] * 2 * mp.pi / period
    return {name: float(value) for name, value in found.items()}
