"""The crank's motion and its inverse, up to the limits of rotatability; its cycle with diagrams and with tables; masses
from the periods of a pendulum."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mpmath as mp
import numpy as np

from solvers import crank
from solvers.references.crank import Machine, Motion
from tests.hard_cases.cases import read
from tests.hard_cases.hunt.quarry import Quarry, between, entries, pick, power
from tests.hard_cases.make_crank_references import DIGITS as DIGITS_OF_A_CYCLE
from tests.hard_cases.make_crank_references import merged, motion_values, pendulum_values, works
from tests.hard_cases.test_crank import EPS, answers, motions, off, units

BASE = read("crank")["base"]

DIGITS = 130
"""A position of 1e-30 is a difference of lengths, and conditions are evaluated by changes in its twentieth digit."""


def motion(point: np.ndarray) -> dict:
    """Rod, offset, an angle about a dead centre, across or anywhere, and a position near either end."""
    radius = between(point[0], 0.02, 0.09)
    length = radius * (1.0 + power(point[1], -9, 6))
    edge = pick(point[2], 0.0, power(point[3], -12, -0.3), 1.0 - power(point[3], -8, -0.3))
    offset = pick(point[4], 1.0, -1.0) * edge * (length - radius)
    off = pick(point[6], 1.0, -1.0) * power(point[6] * 2 % 1, -18, 0)
    angle = pick(point[5], off, math.pi + off, 0.5 * math.pi + off, between(point[6], -50.0, 50.0))
    with mp.workdps(DIGITS):
        turning = Motion(mp.mpf(radius), mp.mpf(length), mp.mpf(offset))
        stroke = turning.high - turning.low
        share = mp.mpf(power(point[8], -30, -0.3))
        position = float(stroke * pick(point[7], share, 1 - share))
        inside = 0 < position < stroke * (1 - mp.mpf(2) ** -52)
    values = {"crank_radius": radius, "rod_length": length, "offset": offset, "angle": angle}
    return {"inputs": values | ({"position": position} if inside else {})}


def judge_motion(case: dict) -> Iterator[tuple[str, float]]:
    with mp.workdps(DIGITS):
        reference = entries(motion_values(case))
    for name, value in motions(case["inputs"]):
        yield name, units(value, reference[name])


def pendulum(point: np.ndarray) -> dict:
    """Relative position of a rod's centre of mass, its inertia relative to the two-mass model, amplitude, and bores."""
    pivots = power(point[0], -3, 1)
    arm = between(point[1], 0.51, 0.95) * pivots
    radius_squared = arm * (pivots - arm) * (1.0 - power(point[2], -3.3, -0.2))
    amplitude = pick(point[3], 0.0, power(point[4], -9, -0.5), between(point[4], 0.3, 1.55))
    late = float(2 * mp.ellipk(mp.sin(amplitude / 2) ** 2) / mp.pi)

    def period(distance):
        return 2 * math.pi * math.sqrt((radius_squared + distance**2) / distance / 9.81) * late

    bore = between(point[5], 0.0, 0.2) * (pivots - arm)
    return {
        "inputs": {
            "pivot_distance": pivots,
            "period_small_end": period(arm),
            "period_big_end": period(pivots - arm),
            "rod_mass": power(point[0], -4, 4),
            "amplitude": amplitude,
            "gravity": 9.81,
            "small_end_bore_radius": bore,
            "big_end_bore_radius": pick(point[3] * 7 % 1, 0.0, bore),
        }
    }


def judge_pendulum(case: dict) -> Iterator[tuple[str, float]]:
    found = crank.swing(crank.Pendulum(**case["inputs"])).values
    with mp.workdps(50):
        reference = entries(pendulum_values(case))
    for name, entry in reference.items():
        yield name, units(found[name], entry)


def cycle(point: np.ndarray) -> dict:
    """Mechanism, masses, speed, clearance, and a diagram or table of arbitrary shape, generated from a few numbers."""
    radius = between(point[0], 0.02, 0.09)
    length = radius * (1.0 + power(point[1], -3, 3))
    offset = pick(point[2], 0.0, between(point[2] * 3 % 1, -0.99, 0.99)) * (length - radius)
    bore = radius * power(point[3], -0.5, 0.5)
    area, motion = math.pi * bore**2 / 4.0, crank.ExactMotion(radius, length, offset)
    clearance = area * motion.stroke * power(point[4], -3, 3)
    shape = np.random.default_rng(int(point[5] * 1e6))
    count, low = int(shape.integers(3, 9)), power(point[6], 3, 7)
    if point[7] < 0.1:  # The reference takes a minute for their work.
        angles = np.sort(shape.uniform(0.0, 4.0 * math.pi, count + 2))
        pressure = {
            "kind": "table",
            "angle": angles.tolist(),
            "pressure": (low * shape.uniform(0.5, 5.0, count + 2)).tolist(),
        }
    else:
        strokes = []
        for _ in range(4):
            share = np.sort(np.concatenate([[0.0, 1.0], shape.uniform(0.02, 0.98, count)]))
            volume = (clearance + area * motion.stroke * share).tolist()
            strokes.append({"volume": volume, "pressure": (low * shape.uniform(0.5, 5.0, count + 2)).tolist()})
        pressure = {"kind": "indicator", "strokes": strokes}
    cg = between(point[8], 0.1, 0.9) * length
    mass = power(point[9], -3, 1)
    return {
        "changes": {
            "mechanism": {
                "crank_radius": radius, "rod_length": length, "offset": offset, "speed": power(point[10], -3, 2.5),
            },
            "cylinder": {"bore": bore, "clearance_volume": clearance},
            "pressure": pressure,
            "masses": {
                "piston": mass, "rod": 2.0 * mass, "rod_cg": cg,
                "rod_inertia": 2.0 * mass * cg * (length - cg) * between(point[8] * 7 % 1, 0.5, 1.5),
            },
        }
    }  # fmt: skip


def judge_cycle(found: dict) -> Iterator[tuple[str, float]]:
    """Errors of the works, and of the worst forces compared with the exact forces at the reported angles."""
    whole = found | {"scene": merged(BASE, found["changes"])}
    outcome, told = answers(whole, 1e-12)
    with mp.workdps(DIGITS_OF_A_CYCLE):
        machine = Machine(whole["scene"])
        breaks, period = machine.gas.breaks, machine.gas.period
        forces = {}
        for worst in outcome.value.worst:
            # A data point next to a dead centre is a separate break; the reported force is the greatest over all breaks
            # nearby.
            at = mp.mpf(worst.angle)
            near = [at, *(b for b in breaks if abs(b - at) < 1e-7)]
            sides = [machine.forces(b, before)[worst.name] for b in near for before in (False, True)]
            forces[worst.name] = max(sides, key=lambda pair: pair[0])
        forces |= works(machine, machine.gas.work_to(breaks[0] + period))
        for name, (value, size) in forces.items():
            entry = {"value": mp.nstr(value, 30)}
            yield name, float(off(told[name], entry)) / max(float(size), abs(float(value)), 2.0**-1022) / EPS


QUARRIES = (
    Quarry("crank", "motions", "motion", 9, motion, judge_motion),
    Quarry("crank", "cycles", "cycle", 11, cycle, judge_cycle),
    Quarry("crank", "pendulums", "pendulum", 6, pendulum, judge_pendulum),
)
