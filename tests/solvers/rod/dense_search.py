"""The design problem solved again by sampling everything: core physics, Schmidt's load, nothing of the solver shared.

Strips are sampled on a grid over bending stiffness, free length and thickness, and the grid is drawn together around
its best strips. Stresses are sampled as well (complex trigonometry, one formula for tension and compression), so peaks
between the samples are missed by up to MISSED; ``margin`` keeps the strips called admissible clear of that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers import rod

MISSED = 4e-3
COUNTS = (4, 14, 8)
CRITICAL = np.linspace(0.0, 4.4934094579, 2001)[1:]
TERMS = (np.sin(CRITICAL) - CRITICAL * np.cos(CRITICAL), CRITICAL**2 * np.sin(CRITICAL))
"""What the buckling equation has on that grid, whatever beta is."""


def critical_phase(beta):
    """First root x(beta) of the buckling equation: a sign change on a fine grid, then bisection."""

    def value(x, b):
        return b * b * (np.sin(x) - x * np.cos(x)) + (1 - b) * x * x * np.sin(x)

    low = np.array([CRITICAL[np.flatnonzero(b * b * TERMS[0] + (1 - b) * TERMS[1] > 0)[-1]] for b in beta])
    high = np.minimum(low + CRITICAL[0], CRITICAL[-1])
    for _ in range(45):
        middle = 0.5 * (low + high)
        positive = value(middle, beta) > 0
        low, high = np.where(positive, middle, low), np.where(positive, high, middle)
    return low


@dataclass
class Sampled:
    """Results of many strips, each of shape (strips,): utilisation 1/n, safeties, reactions, mass."""

    mass: np.ndarray
    fatigue: np.ndarray
    stability: np.ndarray
    strength: np.ndarray
    side: np.ndarray
    pressure: np.ndarray
    power: np.ndarray

    def cost(self, objective):
        """What is made small: the result itself, or the inverse of a safety."""
        with np.errstate(divide="ignore"):
            return {
                "mass": self.mass, "friction_power": self.power, "contact_pressure": self.pressure,
                "side_force": self.side, "fatigue_safety": 1 / self.fatigue, "stability_safety": 1 / self.stability,
            }[objective]  # fmt: skip

    def admissible(self, r, margin):
        keep = 1 + margin
        ok = (self.fatigue >= r.min_fatigue_safety * keep) & (
            self.stability >= r.min_stability_safety * (1 + min(margin, 1e-9))
        )
        if r.min_yield_safety is not None:
            ok &= self.strength >= r.min_yield_safety * keep
        if r.max_contact_pressure is not None:
            ok &= self.pressure * keep <= r.max_contact_pressure
        if r.max_friction_power is not None:
            ok &= self.power * keep <= r.max_friction_power
        return ok


def sample(scene, b, h, l, angles=96, sections=33):
    """Everything about strips given as arrays of equal length."""
    parts = [
        _sample(scene, b[i : i + 200], h[i : i + 200], l[i : i + 200], angles, sections) for i in range(0, b.size, 200)
    ]
    return Sampled(*(np.concatenate([getattr(p, n) for p in parts]) for n in Sampled.__dataclass_fields__))


def _sample(scene, b, h, l, angles, sections):
    load, m, p, material = scene.load, scene.mechanism, scene.piston, scene.material
    phi = (np.arange(angles) + 0.5) * 2 * np.pi / angles
    back = load.p_min * (1 + load.delta) / np.sqrt(1 - load.delta**2)
    pressure = load.p_min * (1 + load.delta) / (1 - load.delta * np.cos(phi - load.theta))
    force = -(pressure - back) * np.pi * p.diameter**2 / 4
    fine = np.linspace(0, 2 * np.pi, 20001)
    peak = load.p_min * (1 + load.delta) / (1 - load.delta * np.cos(fine - load.theta))
    compression = (peak.max() - back) * np.pi * p.diameter**2 / 4
    E, L = material.elastic_modulus, m.rod_length
    stiffness = E * b * h**3 / 12
    weak = E * b * h * np.minimum(b, h) ** 2 / 12
    with np.errstate(all="ignore"):
        stability = weak * (critical_phase(l / L) / l) ** 2 / compression
        k = np.sqrt(-force[None, :] / stiffness[:, None] + 0j)
        n, e = l[:, None], (L - l)[:, None]
        s0, s1 = np.cos(k * n), np.sin(k * n) / k
        s2, s3 = (1 - s0) / k**2, (k * n - np.sin(k * n)) / k**3
        a00, a01, a10, a11 = s2 + e * s1, s3 + e * s2, s0 - e * k**2 * s1, s1 + e * s0
        det = a00 * a11 - a01 * a10
        lateral = m.crank_radius * np.sin(phi)
        c, d = lateral * a11 / det, -lateral * a10 / det
        side = -stiffness[:, None] * np.real(d)
        moment = stiffness[:, None] * np.real(c)
        z = np.linspace(0, 1, sections)[None, :, None] * l[:, None, None]
        wave = k[:, None, :] * z
        bent = np.real(c[:, None] * np.cos(wave) + d[:, None] * np.sin(wave) / k[:, None])
    direct = (force[None, :] / (b * h)[:, None])[:, None, :]
    bending = 0.5 * E * h[:, None, None] * bent
    use, strength = np.zeros(b.size), np.zeros(b.size)
    for sign in (1, -1):
        stress = direct + sign * bending
        high, low = stress.max(axis=2), stress.min(axis=2)
        amplitude, mean = (high - low) / 2, np.maximum((high + low) / 2, 0)
        damage = (material.fatigue_reduction * amplitude + material.mean_stress_sensitivity * mean).max(axis=1)
        use = np.maximum(use, damage / material.fatigue_limit)
        strength = np.maximum(strength, np.maximum(high, -low).max(axis=1))
    skew = 6 * np.abs(moment + side * p.clamp_offset) / p.skirt_length
    sine, lam = np.sin(phi), m.crank_radius / L
    speed = np.abs(
        m.crank_radius * 2 * np.pi * m.speed
        * (sine + lam * sine * np.cos(phi) / np.sqrt(1 - (lam * sine) ** 2))
    )  # fmt: skip
    # integral of |T + 2 skew x| over x in [-1/2, 1/2]
    T = np.abs(side)
    wall = np.where(skew > T, 0.5 * (skew + T**2 / np.where(skew > 0, skew, 1)), T)
    return Sampled(
        mass=material.density * b * h * l,
        fatigue=np.where(stability > 1, 1 / use, 0.0),
        stability=stability,
        strength=np.where(stability > 1, material.yield_strength / strength, 0.0),
        side=T.max(axis=1),
        pressure=(T + skew).max(axis=1) * 4 / (np.pi * p.diameter * p.skirt_length),
        power=(wall * speed).mean(axis=1) * p.friction_coefficient * 4 / np.pi,
    )


def dense_search(problem, objective, requirements, margin=MISSED, known=None):
    """(cost, b, h, l) of the best strip found that keeps ``margin`` from the requirements; cost inf if none does.

    A ``known`` strip is looked at first as well, where admissible ones may hide between the first look's strips.
    """
    bounds = problem.bounds
    low = np.array([bounds.b[0], bounds.h[0], bounds.l[0]])
    high = np.array([bounds.b[1], bounds.h[1], min(bounds.l[1], problem.scene.mechanism.rod_length)])
    best, rng = (np.inf, np.nan, np.nan, np.nan), np.random.default_rng(0)
    axes = [np.geomspace(a, z, n) for a, z, n in zip(low, high, COUNTS, strict=True)]
    b, h, l = (a.ravel() for a in np.meshgrid(*axes))
    if known is not None:
        b, h, l = np.append(b, known.b), np.append(h, known.h), np.append(l, known.l)
    reach = 1.5 * np.log(high / low) / (np.array(COUNTS) - 1)
    for turn in range(14):
        fine = {"angles": 96, "sections": 33} if turn else {"angles": 48, "sections": 17}
        found = sample(problem.scene, b, h, l, **fine)
        # The first, coarse look must not leave out what the later ones would take in.
        cost = np.where(found.admissible(requirements, margin if turn else 3 * margin), found.cost(objective), np.inf)
        at = int(cost.argmin())
        if cost[at] < best[0]:
            best = (float(cost[at]), float(b[at]), float(h[at]), float(l[at]))
        if not np.isfinite(best[0]):
            return best
        cloud = np.log(best[1:]) + reach * rng.uniform(-1, 1, (30, 3)) * 0.75**turn
        b, h, l = np.clip(np.exp(cloud), low, high).T
    return best


def random_problem(rng, objective, machine):
    """A problem that one known strip, of a random machine, solves: (problem, the strip)."""
    scene, strip = machine(rng)
    around = lambda v, low, high: (v * rng.uniform(low, 1.0), v * rng.uniform(1.0, high))  # noqa: E731
    length = around(strip.l, 0.4, 1.9)
    bounds = rod.Bounds(around(strip.b, 0.5, 1.8), around(strip.h, 0.4, 2.5),
                        (length[0], min(length[1], scene.mechanism.rod_length)))  # fmt: skip
    own = sample(scene, *(np.array([v]) for v in (strip.b, strip.h, strip.l)))
    give = lambda: rng.uniform(0.6, 0.97)  # noqa: E731
    sometimes = lambda value: value if rng.uniform() < 0.4 else None  # noqa: E731
    requirements = rod.Requirements(
        min_fatigue_safety=float(own.fatigue[0]) * give(),
        min_stability_safety=max(float(own.stability[0]) * give(), 1.0),
        max_contact_pressure=sometimes(float(own.pressure[0]) / give()),
        max_friction_power=sometimes(float(own.power[0]) / give()),
        min_yield_safety=sometimes(float(own.strength[0]) * give()),
    )
    return rod.RodProblem(scene, bounds, requirements, rod.OBJECTIVES[objective]), strip
