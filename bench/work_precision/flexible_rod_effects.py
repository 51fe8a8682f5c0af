"""What each effect of the flexible rod costs: on top of the core (gas load, beam-column, friction), and all together.

Judged are the fatigue safety, the greatest side force and the friction power of the paper's rod and of plain random
machines: Schmidt's load with delta below 0.6, some friction, a stability safety above 1.3, the strip's own frequency at
least three times the crank's. Times are those of the library's call, not of a request. Every part has a reference of
its own, which shares no code with the solver (`oracles/dense/rod_effects.py`, `rod_vibration.py`): closed forms on
dense grids with bracketed friction, the third order by variation of constants, the moving strip by Galerkin's method
and collocation in time, not split into a still and a moving part. They are good to some 1e-11; where the strip moves
under a force with friction's corners, behind which every mode rings, to some 1e-8.
Four of the moving strips, with natural frequencies of 4 to 14 times the crank's, do not reach 1e-10, one of them not
1e-8; their estimates say so.

Peers are what an engineer would write: closed forms on a grid with numpy, with friction by a fixed-point iteration; the
elastica by scipy's solve_bvp at every angle; Hermite beam elements with a periodic collocation of their modes; and such
modes through scipy's solve_ivp (DOP853), the periodic start from the monodromy. Nobody writes all effects together: for
these there is no peer. In the diagram peers are dashed.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp, solve_ivp
from scipy.linalg import eigh

from bench.campaign.scenes import scenes
from bench.work_precision.curves import Method, Results
from oracles.dense.rod_effects import RodModel
from solvers import rod
from tests.solvers.rod.finite_elements import matrices, periodic_field
from tests.solvers.rod.machines import PAPER, STRIP

Array = NDArray[np.float64]

TITLE = "The flexible rod's effects"
CASES = 20
JUDGED = ("fatigue_safety", "side_force_max_n", "friction_power_w")
EFFECTS = ("shear", "friction_feedback", "large_displacement", "rod_inertia")
PARTS = {"core": (), **{name: (name,) for name in EFFECTS}, "all": EFFECTS}
"""Active effects of each part, besides the core."""
LADDER = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
_GOALS = {"all": {"accuracy 1e-06": 10e-3, "accuracy 1e-08": 35e-3}}
_CORE = frozenset({"beam_column", "friction"})
_MIN_SAFETY, _MIN_PACE, _MAX_DELTA = 1.3, 3.0, 0.6
_ELASTICA_GRID, _ELASTICA_TOLERANCE = 72, 1e-8


@dataclass(frozen=True)
class EffectsCase:
    """A machine and its strip."""

    scene: rod.Scene
    strip: rod.Dimensions

    def model(self, part: str) -> RodModel:
        return RodModel(self.scene, self.strip, frozenset(PARTS[part]))

    @cached_property
    def core(self) -> RodModel:
        return self.model("core")

    def check(self, part: str, accuracy: float) -> rod.RodCheck:
        active = _CORE | set(PARTS[part])
        effects = rod.EffectSelection(active, frozenset({"reciprocating_inertia", *EFFECTS}) - active)
        return rod.check(self.scene, self.strip, effects, accuracy=accuracy).value


def cases(count: int) -> list[EffectsCase]:
    """The paper's rod, complemented by ordinary random machines."""
    found, seed = [EffectsCase(PAPER, STRIP)], 60_000
    while len(found) < count:
        drawn = next(scenes("flexible-rod", 1, first_seed=seed))
        seed += 1
        load, friction = drawn.body["load"], drawn.body["piston"]["friction_coefficient"]
        if load["kind"] != "schmidt" or load["delta"] > _MAX_DELTA or friction == 0.0:
            continue
        request = drawn.request()
        case = EffectsCase(request.scene(), request.strip())
        value = case.check("friction_feedback", 1e-3)
        slow = value.natural_frequency < _MIN_PACE * case.scene.mechanism.speed
        if value.stresses is not None and value.stability_safety > _MIN_SAFETY and not slow:
            found.append(case)
    for part in PARTS:
        # Compile before measuring.
        found[0].check(part, 1e-3)
    return found


def reference(case: EffectsCase) -> Results:
    """The reference values of the judged results of every part."""
    found = {}
    for part in PARTS:
        found |= _told(part, **case.model(part).judged())
    return found


def _told(part: str, **results: float) -> Results:
    return {f"{part}: {name}": value for name, value in results.items()}


def _ours(part: str, accuracy: float, case: EffectsCase) -> Results:
    found = case.check(part, accuracy).stresses
    return _told(part, **dict(zip(JUDGED, (found.fatigue_safety, found.side_force_max, found.friction_power),
                                  strict=True)))  # fmt: skip


def _from_fields(
    part: str, case: EffectsCase, angle: Array, force: Array, curvature: Array, side: Array, moment: Array
) -> Results:
    """The judged results of fields at uniform angles; tangential force N and curvature are (sections, angles)."""
    d, modulus, model, worst = case.strip, case.scene.material.elastic_modulus, case.core, 0.0
    for fibre in (1.0, -1.0):
        stress = force / (d.b * d.h) + fibre * 0.5 * modulus * d.h * curvature
        worst = max(worst, float(model.severity(stress.max(axis=1), stress.min(axis=1)).max()))
    return _told(
        part,
        fatigue_safety=case.scene.material.fatigue_limit / worst,
        side_force_max_n=float(np.abs(side).max()),
        friction_power_w=float(model.power_at(angle, side, moment).mean()),
    )


def _angles(count: int) -> Array:
    return np.arange(count) * 2.0 * math.pi / count


def _closed_form(part: str, angles: int, sections: int, tolerance: float, case: EffectsCase) -> Results:
    """Closed form on a grid; with friction feedback, P = P0 + friction(P) by fixed-point iteration to a tolerance."""
    model, angle = case.model(part), _angles(angles)
    gas, lateral = model.gas_force(angle), model.lateral(angle)
    force = gas
    if part == "friction_feedback":
        for _ in range(100):
            before, force = force, gas + model.friction(force, lateral)
            if np.abs(force - before).max() <= tolerance * np.abs(force).max():
                break
        else:
            raise ArithmeticError("the iteration does not converge")
    scaled, softening, clamp, shear = model.constants(force, model.compliance)
    k, z = np.sqrt(-scaled + 0j), np.linspace(0.0, case.strip.l, sections)[:, None]
    bent = np.real(clamp * lateral * np.cos(k * z) + shear * lateral * np.sin(k * z) / k)
    side, moment = -model.stiffness * softening * shear * lateral, model.stiffness * clamp * lateral
    return _from_fields(part, case, angle, np.broadcast_to(force, bent.shape), bent, side, moment)


def _elastica(angles: int, tolerance: float, case: EffectsCase) -> tuple[Array, ...]:
    """The elastica: angles, N and curvature at 41 sections, side force, clamp moment."""
    model, angle, l = case.core, _angles(angles), case.strip.l
    bent, e = model.bent(angle), model.head / l
    mesh, stations = np.linspace(0.0, 1.0, 21), np.linspace(0.0, 1.0, 41)
    start = np.stack([model.slope(bent, l * mesh[:, None]), model.curvature(bent, l * mesh[:, None]) * l,
                      model.deflection(bent, l * mesh[:, None]) / l])  # fmt: skip
    along, curved = np.empty((2, stations.size, angles))
    side, moment = np.empty((2, angles))
    for i in range(angles):
        q, s = bent.force[i] / model.stiffness * l * l, bent.lateral[i] / l

        def equations(_: Array, y: Array, p: Array, q: float = q) -> Array:
            return np.vstack([y[1], q * np.sin(y[0]) + p[0] * np.cos(y[0]), np.sin(y[0])])

        def ends(a: Array, b: Array, p: Array, q: float = q, s: float = s) -> Array:
            pulled = b[1] + e * (q * np.sin(b[0]) + p[0] * np.cos(b[0]))
            return np.array([a[0], a[2], b[2] + e * np.sin(b[0]) - s, pulled])

        found = solve_bvp(equations, ends, mesh, start[..., i], p=[bent.shear[i] * l * l], tol=tolerance)
        if not found.success:
            raise ArithmeticError(found.message)
        turn, bend, _ = found.sol(stations)
        curved[:, i], across = bend / l, found.p[0] * model.stiffness / l**2
        along[:, i] = bent.force[i] * np.cos(turn) - across * np.sin(turn)
        side[i], moment[i] = -across, model.stiffness * bend[0] / l
    return angle, along, curved, side, moment


def _by_elastica(angles: int, tolerance: float, case: EffectsCase) -> Results:
    return _from_fields("large_displacement", case, *_elastica(angles, tolerance, case))


def remarks(given: list[EffectsCase]) -> list[str]:
    """Remark on the truncation error of the third order relative to the elastica, on the same grid."""
    found = []
    for case in given:
        exact = _from_fields("core", case, *_elastica(_ELASTICA_GRID, _ELASTICA_TOLERANCE, case))
        model, z = case.model("large_displacement"), np.linspace(0.0, case.strip.l, 41)[:, None]
        bent = model.bent(_angles(_ELASTICA_GRID))
        fields = model.tangent_force(bent, z), model.curvature(bent, z), bent.side, bent.moment
        third = _from_fields("core", case, bent.angle, *fields)
        found.append(max(abs(third[n] / exact[n] - 1.0) for n in exact))
    return [
        "The effect `large_displacement` is an expansion; its reference here solves the same third order. The elastica "
        f"itself differs from that by {found[0]:.1g} on the paper's rod, {statistics.median(found):.1g} in the median "
        f"and {max(found):.1g} at most over the cases: the model's own error, no accuracy removes it."
    ]


def _from_elements(
    case: EffectsCase, angle: Array, force: Array, elements: int, field: Array, second: Array
) -> Results:
    """Results from nodal deflections and rotations (angles, freedoms) and their second derivatives in the angle."""
    model, h = case.core, case.strip.l / elements
    bending, geometric, mass, _, _ = matrices(case.strip.l, case.scene.mechanism.rod_length, elements)
    line = _line_inertia(case)
    # T and M0 are the reactions at the first node, including inertia.
    first = model.stiffness * field @ bending[:2].T + force[:, None] * (field @ geometric[:2].T)
    first += line * second @ mass[:2].T
    side, moment = -first[:, 0], -first[:, 1]
    v, t = field[:, ::2].T, field[:, 1::2].T
    starts = (6 * (v[1:] - v[:-1]) / h - 4 * t[:-1] - 2 * t[1:]) / h
    ends = (-6 * (v[1:] - v[:-1]) / h + 2 * t[:-1] + 4 * t[1:]) / h
    bent = np.vstack([moment / model.stiffness, 0.5 * (starts[1:] + ends[:-1]), ends[-1:]])
    return _from_fields("rod_inertia", case, angle, np.broadcast_to(force, bent.shape), bent, side, moment)


def _line_inertia(case: EffectsCase) -> float:
    """rho A omega^2 [N/m^2]."""
    return case.scene.material.density * case.strip.b * case.strip.h * case.scene.mechanism.angular_speed**2


def _periodic_elements(angles: int, elements: int, modes: int, case: EffectsCase) -> Results:
    angle = _angles(angles)
    force = case.core.gas_force(angle)
    still, departure, second = periodic_field(case.scene, case.strip, angle, force, elements, modes)
    return _from_elements(case, angle, force, elements, still + departure, second)


def _integrated_modes(modes: int, tolerance: float, count: int, case: EffectsCase) -> Results:
    """Modal integration (32 elements, modes under the mean force) with the periodic start from the monodromy matrix.

    The field is the quasi-static one under the inertia of the modes.
    """
    model, elements = case.core, 32
    bending, geometric, mass, free, unit = matrices(case.strip.l, case.scene.mechanism.rod_length, elements)
    angle, line = _angles(count), _line_inertia(case)
    force, lateral = model.gas_force(angle), model.lateral(angle)
    mean = float(force.mean())
    stiff = model.stiffness * bending + mean * geometric
    squares, vectors = eigh(free.T @ stiff @ free, line * free.T @ mass @ free)
    squares, shapes = squares[:modes], free @ vectors[:, :modes]
    lift = unit + free @ np.linalg.solve(free.T @ stiff @ free, -free.T @ stiff @ unit)
    softening, pulled = shapes.T @ geometric @ shapes, shapes.T @ geometric @ lift
    carried = line * shapes.T @ mass @ lift

    def acceleration(phi: float, y: Array, forced: Array) -> Array:
        swing, s = float(model.gas_force(np.array(phi))) - mean, case.scene.mechanism.crank_radius * math.sin(phi)
        pushed = np.outer(s * (carried - swing * pulled), forced)
        return pushed - squares[:, None] * y - swing * (softening @ y)

    def turned(start: Array, forced: Array, at: Array | None = None) -> NDArray:
        def rates(phi: float, flat: Array) -> Array:
            y, v = flat.reshape(2, modes, -1)
            return np.concatenate([v, acceleration(phi, y, forced)]).ravel()

        scale = 1e-3 * tolerance * case.scene.mechanism.crank_radius
        return solve_ivp(rates, (0.0, 2 * math.pi), start.ravel(), "DOP853", at, rtol=tolerance, atol=scale)

    # Unit states are scaled by the crank radius, so that one tolerance suits all columns.
    radius, columns = case.scene.mechanism.crank_radius, 2 * modes + 1
    starts = radius * np.eye(2 * modes, columns)
    ended = turned(starts, np.eye(1, columns, columns - 1)[0]).y[:, -1].reshape(2 * modes, columns)
    start = np.linalg.solve(np.eye(2 * modes) - ended[:, :-1] / radius, ended[:, -1])
    # No output at 2 pi, which coincides with 0.
    y = turned(start, np.ones(1), angle).y[:modes]
    second = np.stack([acceleration(a, c[:, None], np.ones(1))[:, 0] for a, c in zip(angle, y.T, strict=True)])
    second = second @ shapes.T - lateral[:, None] * lift
    systems = model.stiffness * bending + force[:, None, None] * geometric
    right = -np.einsum("aij,j->ai", systems, unit) * lateral[:, None] - line * second @ mass
    inner = np.linalg.solve(free.T @ systems @ free, (right @ free)[..., None])[..., 0]
    return _from_elements(case, angle, force, elements, inner @ free.T + lateral[:, None] * unit, second)


def methods() -> Iterator[Method[EffectsCase]]:
    """For every part the library's accuracy ladder, then its peers."""
    sizes = ((90, 11, 1e-4), (360, 41, 1e-6), (1440, 161, 1e-8))
    for part in PARTS:
        ladder = {f"accuracy {a:g}": partial(_ours, part, a) for a in LADDER}
        yield Method("Crankwright", ladder, part=part, goals=_GOALS.get(part, {}))
        peers: dict[str, dict[str, Callable[[EffectsCase], Results]]] = {}
        if part in ("core", "shear", "friction_feedback"):
            name = "numpy grid, fixed point" if part == "friction_feedback" else "numpy grid"
            grids = {f"{n} angles, {m} sections": partial(_closed_form, part, n, m, t) for n, m, t in sizes}
            peers[name] = grids
        elif part == "large_displacement":
            solver = {f"{n} angles, tol {t:g}": partial(_by_elastica, n, t) for n, t in ((24, 1e-3), (96, 1e-5))}
            peers["scipy solve_bvp, elastica"] = solver
        elif part == "rod_inertia":
            shapes = ((40, 8, 4), (72, 16, 6), (120, 32, 8))
            peers["beam elements, periodic collocation"] = {
                f"{a} angles, {n} elements, {m} modes": partial(_periodic_elements, a, n, m) for a, n, m in shapes
            }
            orders = ((3, 1e-4, 180), (6, 1e-7, 720))
            peers["beam modes, scipy solve_ivp"] = {
                f"{m} modes, rtol {t:g}, {a} angles": partial(_integrated_modes, m, t, a) for m, t, a in orders
            }
        for name, settings in peers.items():
            # solve_ivp takes half a minute on the modes of a stiff strip.
            yield Method(name, settings, 5 if name in _EXPENSIVE else CASES, part)


_EXPENSIVE = ("scipy solve_bvp, elastica", "beam modes, scipy solve_ivp")
