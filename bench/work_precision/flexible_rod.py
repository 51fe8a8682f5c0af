"""The strip's fatigue safety and side force, in the physics that all methods share: gas load, beam-column, guide.

Beside the library's own ladder stand the ways an engineer would do it otherwise: the closed form with numpy on grids
of angles and sections, coarse ones too, Hermite beam elements, and scipy's boundary-value solver, both at sampled
angles. The reference is the closed form in complex trigonometry, searched densely and polished by scipy's bounded
search.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial

import numpy as np
from scipy.integrate import solve_bvp

from bench.campaign.scenes import Scene, scenes
from bench.work_precision.curves import Method, Results
from solvers import rod
from tests.solvers.rod.brute_force import CoreModel, greatest
from tests.solvers.rod.finite_elements import matrices

TITLE = "The flexible rod's check"
CASES = 200
JUDGED = ("fatigue_safety", "side_force_max_n")
_CORE = rod.EffectSelection(
    frozenset({"beam_column"}),
    frozenset({"reciprocating_inertia", "rod_inertia", "large_displacement", "shear", "friction_feedback", "friction"}),
)
_LADDER = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
_GOALS = {"accuracy 0.01": 0.2e-3, "accuracy 1e-06": 0.4e-3, "accuracy 1e-12": 0.7e-3}
_GRIDS = ((12, 3), (24, 4), (36, 5), (90, 11), (360, 41), (1440, 161))


class RodCase:
    """A random machine under Schmidt's load, with its dense model."""

    def __init__(self, scene: Scene) -> None:
        asked = scene.request()
        self.scene, self.strip = asked.scene(), asked.strip()

    def check(self, accuracy: float) -> rod.RodCheck:
        return rod.check(self.scene, self.strip, _CORE, accuracy=accuracy).value

    @cached_property
    def model(self) -> CoreModel:
        return CoreModel(self.scene, self.strip)

    def severity(self, high: float, low: float) -> float:
        """The equivalent amplitude by which the fatigue limit is divided in Serensen's safety."""
        m = self.model.scene.material
        return m.fatigue_reduction * 0.5 * (high - low) + m.mean_stress_sensitivity * np.maximum(
            0.5 * (high + low), 0.0
        )

    def safety(self, severity: float) -> float:
        return self.model.scene.material.fatigue_limit / severity


def cases(count: int) -> list[RodCase]:
    """Random machines under Schmidt's load, a quarter of them hard, excluding strips close to buckling."""
    found: list[RodCase] = []
    for scene in scenes("flexible-rod", 10 * count, first_seed=50_000):
        # A buckled strip has no stresses to judge.
        if scene.body["load"]["kind"] == "schmidt" and (case := RodCase(scene)).check(1e-3).stresses is not None:
            found.append(case)
        if len(found) == count:
            break
    return found


def reference(case: RodCase) -> Results:
    """The reference values of the judged results, by dense search."""
    model = case.model
    return {
        "fatigue_safety": case.safety(model.worst(case.severity)),
        "side_force_max_n": greatest(lambda a: np.abs(model.side_force(a))),
    }


def _ours(accuracy: float, case: RodCase) -> Results:
    found = case.check(accuracy).stresses
    return dict(zip(JUDGED, (found.fatigue_safety, found.side_force_max), strict=True))


def _from_fields(case: RodCase, force: np.ndarray, curvature: np.ndarray, side: np.ndarray) -> Results:
    """The judged results of sampled fields; ``curvature`` has shape (sections, angles)."""
    d, modulus = case.model.d, case.model.scene.material.elastic_modulus
    worst = 0.0
    for fibre in (1.0, -1.0):
        stress = force / (d.b * d.h) + fibre * 0.5 * modulus * d.h * curvature
        worst = max(worst, float(case.severity(stress.max(axis=1), stress.min(axis=1)).max()))
    return {"fatigue_safety": case.safety(worst), "side_force_max_n": float(np.abs(side).max())}


def _angles(count: int) -> np.ndarray:
    return np.arange(count) * 2 * math.pi / count


def _closed_form(angles: int, sections: int, case: RodCase) -> Results:
    model, angle = case.model, _angles(angles)
    bent = model.curvature(np.linspace(0.0, model.d.l, sections)[:, None], angle)
    return _from_fields(case, model.force(angle), bent, model.side_force(angle))


def _finite_elements(angles: int, elements: int, case: RodCase) -> Results:
    model, angle = case.model, _angles(angles)
    scene, d = model.scene, model.d
    bending, geometric, _, free, unit = matrices(d.l, scene.mechanism.rod_length, elements)
    force, lateral = model.force(angle), scene.mechanism.crank_radius * np.sin(angle)
    reduced = [free.T @ m @ free for m in (bending, geometric)]
    pulled = [free.T @ m @ unit for m in (bending, geometric)]
    systems = model.stiffness * reduced[0] + force[:, None, None] * reduced[1]
    right = -(model.stiffness * pulled[0] + force[:, None] * pulled[1])
    field = (np.linalg.solve(systems, right[..., None])[..., 0] @ free.T + unit) * lateral[:, None]
    h, v, t = d.l / elements, field[:, ::2].T, field[:, 1::2].T
    starts = (6 * (v[1:] - v[:-1]) / h - 4 * t[:-1] - 2 * t[1:]) / h
    ends = (-6 * (v[1:] - v[:-1]) / h + 2 * t[:-1] + 4 * t[1:]) / h
    bent = np.vstack([starts[:1], 0.5 * (starts[1:] + ends[:-1]), ends[-1:]])
    side = np.einsum("ij,aj->a", (model.stiffness * bending)[-2:-1], field) + force * (field @ geometric[-2])
    return _from_fields(case, force, bent, side)


def _boundary_values(angles: int, tolerance: float, case: RodCase) -> Results:
    model, angle = case.model, _angles(angles)
    d, e = model.d, model.scene.mechanism.rod_length - model.d.l
    force, lateral = model.force(angle), model.scene.mechanism.crank_radius * np.sin(angle)
    mesh = np.linspace(0.0, 1.0, 11)
    bent, shear = np.empty((41, angles)), np.empty(angles)
    for i, (p, s) in enumerate(zip(force, lateral, strict=True)):
        q = p / model.stiffness * d.l**2

        def slope(_: np.ndarray, y: np.ndarray, q: float = q) -> np.ndarray:
            return np.vstack([y[1], y[2], y[3], q * y[2]])

        def ends(a: np.ndarray, b: np.ndarray, s: float = s) -> np.ndarray:
            return np.array([a[0], a[1], b[0] + e / d.l * b[1] - s, b[2] + e / d.l * b[3]])

        found = solve_bvp(slope, ends, mesh, np.zeros((4, 11)), tol=tolerance)
        if not found.success:
            raise ArithmeticError(found.message)
        bent[:, i] = found.sol(np.linspace(0, 1, 41))[2] / d.l**2
        shear[i] = found.y[3, 0] / d.l**3
    return _from_fields(case, force, bent, -model.stiffness * shear)


def methods() -> Iterator[Method[RodCase]]:
    """The library's accuracy ladder, then the peers."""
    yield Method("Crankwright", {f"accuracy {a:g}": partial(_ours, a) for a in _LADDER}, goals=_GOALS)
    yield Method("closed form on a grid, numpy", _grids(_closed_form, _GRIDS))
    yield Method("Hermite beam elements", _grids(_finite_elements, ((36, 4), (72, 8), (180, 16), (360, 32))), cases=50)
    solver = {f"{n} angles, tol {t:g}": partial(_boundary_values, n, t) for n, t in ((24, 1e-3), (48, 1e-5))}
    yield Method("scipy solve_bvp", solver, cases=10)


def _grids(
    way: Callable[[int, int, RodCase], Results], sizes: tuple[tuple[int, int], ...]
) -> Mapping[str, Callable[[RodCase], Results]]:
    return {f"{angles} angles, {sections} sections": partial(way, angles, sections) for angles, sections in sizes}
