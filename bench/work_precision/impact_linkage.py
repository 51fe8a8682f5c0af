"""Greatest u31, peak crank torque and least swept box of a linkage that strikes.

Beside the ladders of the library and of the service, which reads a request, judges and tells all results with the
transfer's curve, stand the ways an engineer would do it otherwise: the joints placed by intersecting circles with
numpy, pylinkage's compiled steps with velocities, and scipy's fsolve on the loop equation, each at sampled crank
angles, u31' by differences and the box by as many directions. All are told u31 at the blow, where none of them can
stand. The reference is made at 40 digits from the loop equation and the law of cosines, its greatest values closed in
on by golden section.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import mpmath as mp
import numpy as np
from scipy.optimize import fsolve

from app.designs.impact_linkage.kind import case_of
from app.designs.impact_linkage.result import SQUARE_MILLI
from bench.campaign.scenes import Scene, scenes
from bench.linkage import pylinkage_mechanism
from bench.work_precision.curves import Method, Results
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.references import linkage as oracle

TITLE = "The impact linkage's check"
CASES = 200
JUDGED = ("u31_max", "peak_torque_nm", "box_area_mm2")
_CORE = {"include": ["envelope"], "exclude": ["impact_dynamics", "coupler_elasticity", "tolerances"]}
_LADDER = (1e-2, 1e-6, 1e-12)
_GOALS = {f"accuracy {a:g}": 0.3e-3 for a in _LADDER}
_DIGITS = 40
_PEAK_THRESHOLD = 0.7
"""Fraction of the largest sample above which a peak is refined."""
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


class LinkageCase:
    """A random linkage as a request, with ratios and sizes in SI for the peers."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.request = scene.request(effects=_CORE)
        asked, mechanism = self.request.mechanism()
        self.bar: FourBar = mechanism.bar
        self.crank, self.energy = mechanism.crank, asked.impact_energy
        self.pad = scene.body["limits"]["joint_radius_mm"] * 1e-3
        self.lengths = tuple(float(x) for x in (self.bar.ratios.base, self.bar.ratios.coupler, self.bar.ratios.rocker))


def cases(count: int) -> list[LinkageCase]:
    """Random linkages, a quarter of them hard, each designed for one restitution."""
    return [LinkageCase(_sharp(scene)) for scene in scenes("impact-linkage", count, first_seed=50_000)]


def _sharp(scene: Scene) -> Scene:
    asked = scene.body["restitution"]
    middle = 0.5 * (asked["low"] + asked["high"]) if isinstance(asked, dict) else asked
    return replace(scene, body={**scene.body, "restitution": middle})


def reference(case: LinkageCase) -> Results:
    """The reference values of the judged results, at 40 digits."""
    with mp.workdps(_DIGITS):
        body, kind = case.scene.body, case.bar.kind.name
        links = oracle.ratios(kind, body["restitution"], next(iter(body["ratios"].values())))
        base, coupler, rocker = links
        gain = mp.sqrt(base * coupler / rocker)
        reach = base + 1 if kind == "largest_base" else base - 1
        end = (gain + 1) / reach
        speed = 2 * mp.pi * mp.mpf(body["blow_frequency_hz"])
        crank = mp.mpf(body["impact_speed_m_s"]) / (speed * rocker * end)

        def transfer(phi: mp.mpf) -> mp.mpf:
            return abs(oracle.transfer(kind, links, phi))

        def torque(phi: mp.mpf) -> mp.mpf:
            step = mp.mpf(10) ** -12 * min(phi, 2 * mp.pi - phi, 1)
            slope = (transfer(phi + step) - transfer(phi - step)) / (2 * step)
            return abs(2 * mp.mpf(body["impact_energy_j"]) * transfer(phi) * slope / end**2)

        angles = _angles(float(reach), float(mp.sqrt(max(coupler * rocker - base, 0) / (coupler * rocker))))
        area = _least_area(kind, links, crank, mp.mpf(body["limits"]["joint_radius_mm"]) / 1000)
        return {
            "u31_max": float(max(end, _greatest(transfer, angles))),
            "peak_torque_nm": float(_greatest(torque, angles)),
            "box_area_mm2": float(area * 10**6),
        }


def _angles(reach: float, opening: float) -> list[mp.mpf]:
    """Crank angles over a revolution, graded towards the blow from both sides and around pi."""
    near = np.geomspace(0.01 * min(reach, 1.0), 1.0, 60)
    middle = math.pi - np.geomspace(0.1 * max(opening, 1e-6), 1.0, 30)
    half = np.unique(np.concatenate([near, middle, np.linspace(0.02, math.pi - 1e-9, 60)]))
    return [mp.mpf(float(x)) for x in half] + [2 * mp.pi - mp.mpf(float(x)) for x in half[::-1]]


def _greatest(value: Callable[[mp.mpf], mp.mpf], at: list[mp.mpf]) -> mp.mpf:
    """Maximum over sample points, with all peaks above ``_PEAK_THRESHOLD`` times the largest refined."""
    values = [value(x) for x in at]
    best = max(values)
    for k in range(1, len(at) - 1):
        if _PEAK_THRESHOLD * max(values) < values[k] >= max(values[k - 1], values[k + 1]):
            best = max(best, -_least(lambda x: -value(x), at[k - 1], at[k + 1]))
    return best


def _least(value: Callable[[mp.mpf], mp.mpf], low: mp.mpf, high: mp.mpf) -> mp.mpf:
    """Minimum in an interval by golden-section search, which also converges to corners."""
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    fa, fb = value(a), value(b)
    while high - low > mp.mpf(10) ** -18 * (abs(high) + abs(low)):
        if fa <= fb:
            high, b, fb = b, a, fa
            a = high - _GOLDEN * (high - low)
            fa = value(a)
        else:
            low, a, fa = a, b, fb
            b = low + _GOLDEN * (high - low)
            fb = value(b)
    return min(fa, fb)


def _least_area(kind: str, links: tuple[mp.mpf, mp.mpf, mp.mpf], crank: mp.mpf, pad: mp.mpf) -> mp.mpf:
    """Minimum area box around crank circle, pivots and the rocker joint's arc.

    The arc ends at the blow and at the other position with crank and coupler collinear.
    """
    base, coupler, rocker = links
    straight = coupler - 1 if kind == "largest_coupler" else coupler + 1
    corner = mp.acos((base**2 + rocker**2 - straight**2) / (2 * base * rocker))
    # Relative to the rocker pivot, with the base towards pi: the other end lies above the base line, below for c.
    other = mp.pi - corner if kind != "largest_base" else mp.pi + corner
    blow = mp.mpf(0) if kind == "largest_coupler" else mp.pi
    if kind == "largest_rocker":
        other = mp.pi + corner
    first, last = min(blow, other), max(blow, other)
    tips = [(base + rocker * mp.cos(x), rocker * mp.sin(x)) for x in (first, last)]

    def support(beta: mp.mpf) -> mp.mpf:
        c, s = mp.cos(beta), mp.sin(beta)
        found = [mp.mpf(1), base * c] + [x * c + y * s for x, y in tips]
        if (beta - first) % (2 * mp.pi) <= last - first:
            found.append(base * c + rocker)
        return max(found)

    def area(alpha: mp.mpf) -> mp.mpf:
        sides = [support(alpha + k * mp.pi / 2) for k in range(4)]
        return (crank * (sides[0] + sides[2]) + 2 * pad) * (crank * (sides[1] + sides[3]) + 2 * pad)

    count = 360
    places = [k * mp.pi / 2 / count for k in range(-1, count + 2)]
    values = [area(x) for x in places]
    dips = [k for k in range(1, count + 2) if values[k] <= values[k - 1] and values[k] <= values[k + 1]]
    best = sorted(dips, key=values.__getitem__)[:3]
    return min(min(values), *(_least(area, places[k - 1], places[k + 1]) for k in best))


def _ours(accuracy: float, case: LinkageCase) -> Results:
    # From the ratios on, as the peers: scene, mechanism and limits are made within the time.
    found = case_of(case.request)._replace(accuracy=accuracy).evaluate().value
    values = found.strike.peaks.u31, found.strike.peaks.torque, found.box.area / SQUARE_MILLI
    return dict(zip(JUDGED, values, strict=True))


def _service(accuracy: float, case: LinkageCase) -> Results:
    answer = case.scene.solve(effects=_CORE, accuracy=accuracy)
    return {name: answer.result[name] for name in JUDGED}


def _sampled(case: LinkageCase, u: np.ndarray, joint: np.ndarray) -> Results:
    """The judged results from u31 and the rocker joint at midpoints of equal steps over the revolution."""
    if not (np.isfinite(u).all() and np.isfinite(joint).all()):
        raise ArithmeticError("the mechanism did not close")
    count, base = u.size, case.lengths[0]
    slope = np.gradient(np.abs(u), 2 * math.pi / count, edge_order=2)
    turned = (np.arange(count) + 0.5) * 2 * math.pi / count
    pin = np.stack([np.cos(turned), np.sin(turned)])
    points = case.crank * np.hstack([pin, joint, [[0.0, base], [0.0, 0.0]]])
    area = math.inf
    for alpha in np.arange(count) * 0.5 * math.pi / count:
        sides = np.array([[math.cos(alpha), math.sin(alpha)], [-math.sin(alpha), math.cos(alpha)]]) @ points
        area = min(area, float(np.prod(np.ptp(sides, axis=1) + 2 * case.pad)))
    return {
        "u31_max": max(float(np.abs(u).max()), case.bar.u31_end),
        "peak_torque_nm": 2 * case.energy * float(np.abs(u * slope).max()) / case.bar.u31_end**2,
        "box_area_mm2": area * 1e6,
    }


def _circles(count: int, case: LinkageCase) -> Results:
    base, coupler, rocker = case.lengths
    kind = case.bar.kind
    phi = (np.arange(count) + 0.5) * 2 * math.pi / count
    bx, by = kind.crank_sign * np.cos(phi), kind.crank_sign * np.sin(phi)
    x, distance = bx - base, np.hypot(bx - base, by)
    along = (rocker**2 + distance**2 - coupler**2) / (2 * distance)
    across = np.sqrt(np.maximum(rocker**2 - along**2, 0.0))
    # The branch on which the rocker leaves the blow, and remains.
    upward = kind.rocker_sign * (-1.0 if kind.name == "largest_base" else 1.0)
    joints = [
        np.stack([(along * x - s * across * by) / distance, (along * by + s * across * x) / distance]) for s in (1, -1)
    ]
    rx, ry = max(joints, key=lambda j: float((np.sign(j[1]) == upward).sum()))
    dx, dy = base + rx - bx, ry - by
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (bx * dy - by * dx) / (rx * dy - ry * dx)
    return _sampled(case, u, np.stack([base + rx, ry]))


def _pylinkage(count: int, case: LinkageCase) -> Results:
    try:
        made = pylinkage_mechanism(case.bar, count)
        positions, velocities, _ = made.step_fast_with_kinematics(count)
    except Exception as failure:
        raise ArithmeticError(str(failure)) from failure
    # The first step ends at the second angle, the last at the first.
    joint, speed = (np.roll(a[:, 3], 1, axis=0) for a in (positions, velocities))
    arm = joint - [case.lengths[0], 0.0]
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (arm[:, 0] * speed[:, 1] - arm[:, 1] * speed[:, 0]) / (arm**2).sum(axis=1)
    return _sampled(case, u, joint.T)


def _fsolve(count: int, case: LinkageCase) -> Results:
    base, coupler, rocker = case.lengths
    kind = case.bar.kind
    phi = (np.arange(count) + 0.5) * 2 * math.pi / count + (0.0 if kind.crank_sign > 0 else math.pi)
    pin, joint = case.bar.joints(float(math.pi / count))
    at = [math.atan2(*(joint - pin)[::-1, 0]), math.atan2(float(joint[1, 0]), float(joint[0, 0]) - base)]
    u, places = np.empty(count), np.empty((2, count))
    for k, p in enumerate(phi.tolist()):

        def closes(x: np.ndarray, p: float = p) -> list[float]:
            return [
                math.cos(p) + coupler * math.cos(x[0]) - base - rocker * math.cos(x[1]),
                math.sin(p) + coupler * math.sin(x[0]) - rocker * math.sin(x[1]),
            ]

        at, _, found, why = fsolve(closes, at, full_output=True)
        if found != 1:
            raise ArithmeticError(why)
        u[k] = math.sin(p - at[0]) / (rocker * math.sin(at[1] - at[0]))
        places[:, k] = base + rocker * math.cos(at[1]), rocker * math.sin(at[1])
    return _sampled(case, u, places)


def methods() -> Iterator[Method[LinkageCase]]:
    """The ladders of the library and of the service, then the peers."""
    yield Method("Crankwright", {f"accuracy {a:g}": partial(_ours, a) for a in _LADDER}, goals=_GOALS)
    yield Method("Crankwright, a request's answer", {f"accuracy {a:g}": partial(_service, a) for a in _LADDER})
    yield Method("circles, numpy", {f"{n} angles": partial(_circles, n) for n in (90, 360, 1440, 5760)})
    yield Method("pylinkage", {f"{n} angles": partial(_pylinkage, n) for n in (90, 360, 1440)}, cases=50)
    yield Method("scipy fsolve", {f"{n} angles": partial(_fsolve, n) for n in (90, 360)}, cases=20)
