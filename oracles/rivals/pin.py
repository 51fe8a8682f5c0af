"""Competitors of a pin or bushing design: local searches that only use the check.

A shape is given by t = D - d (twice the wall) at positions of a half or of the whole. Everything a form allows is
searched: sizes and positions of steps; both ends of a cone, which may narrow or widen, and its length; waves of a free
bore, asymmetric halves, a stiff collar anywhere, a stiff middle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from oracles.rivals.hunt import Array, Hunt, Look, Space
from oracles.rivals.starts import Strength, along, compete, step_along_limits
from solvers import pin
from solvers.effects import EffectSelection
from solvers.pin.check import halves_alike, on_profile
from solvers.pin.effects import Physics, choose_for, compose
from solvers.pin.optimum.design_variable import design_variable_of
from solvers.pin.ring import ovalization

ACCURACY = 1e-8
_THINNEST, _THICKEST = 1e-7, 4.0
"""Limits of the searched walls relative to the answer's: the minimum (of the thickest), and the maximum of a
bushing."""
_WAVES, _FEW = 7, 5
_STEEPEST = 1.5
"""Maximum logarithmic scaling of a wall by waves."""
_ON_EDGE = 1e-4
_MISSED = math.nan


@dataclass(frozen=True)
class Shape:
    """t = D - d [m] at non-decreasing positions [m], linear in between; two at one position are a step."""

    x: Array
    wall: Array


class Figures(NamedTuple):
    """Results of a shape, None if undefined; maximum ovalization and hoop stress are the ring's."""

    mass: float
    use: float | None
    deflection: float | None
    ovalization: float | None
    ring_stress: float | None


class Part(Protocol):
    """Interface of a pin or bushing for searches."""

    limits: pin.Limits
    half: float

    @property
    def thickest(self) -> float:
        """The maximum t [m]; inf if there is none."""

    def size(self, wall: Array) -> Array:
        """The profile's diameter [m], of bore or outside, for t."""

    def figures(self, profile: pin.Profile) -> Figures:
        """Evaluate a profile."""


@dataclass(frozen=True)
class _Sought:
    """A design problem, its limits and half of its length [m]."""

    problem: pin.PinProblem

    @property
    def limits(self) -> pin.Limits:
        return self.problem.limits

    @property
    def half(self) -> float:
        return 0.5 * self.problem.scene.geometry.length


@dataclass(frozen=True)
class Pin(_Sought):
    """A pin, evaluated with only those parts of the check that searches need, in a third of its time."""

    physics: Physics

    @property
    def thickest(self) -> float:
        return self.problem.scene.geometry.outer_diameter

    def size(self, wall: Array) -> Array:
        return np.maximum(self.thickest - wall, 0.0)

    def figures(self, profile: pin.Profile) -> Figures:
        scene = self.problem.scene
        g, m = scene.geometry, scene.material
        whole, variable = profile.along(g.length), design_variable_of(scene)
        sizes = np.array(whole.bore)
        if not halves_alike(scene, whole):
            scene = replace(scene, symmetric=False)
        found, _ = on_profile(scene, whole, self.problem.criterion, self.physics, ACCURACY)
        wall = found.walls
        oval = stress = None
        if (self.limits.max_ovalization or self.limits.max_ring_stress) is not None and wall.min() > 0.0:
            widest, middle = (
                ovalization.ring(scene.force, g.outer_diameter, g.length, 1.0 - w, m.elastic_modulus, m.poisson)
                for w in (float(wall.min()), float(wall[-1 if scene.symmetric else wall.size // 2]))
            )
            oval, stress = widest.ovalization, max(widest.greatest, middle.greatest)
        mass = variable.mass_of(scene, np.array(whole.x), sizes)
        return Figures(mass, float(found.utilisations.max()), found.deflection, oval, stress)


@dataclass(frozen=True)
class Bushing(_Sought):
    """A bushing, by its check."""

    selection: EffectSelection

    @property
    def thickest(self) -> float:
        return math.inf

    def size(self, wall: Array) -> Array:
        return self.problem.scene.geometry.bore + wall

    def figures(self, profile: pin.Profile) -> Figures:
        p = self.problem
        found = pin.check(p.scene, profile, p.criterion, p.limits, self.selection, accuracy=ACCURACY).value
        oval, stress = (None, None) if found.ring is None else (found.ring.ovalization_max, found.ring.stress_max)
        return Figures(found.mass, found.strength_utilisation, found.deflection, oval, stress)


def pin_of(problem: pin.PinProblem, selection: EffectSelection) -> Pin:
    """A pin with the effects of an answer."""
    return Pin(problem, compose(choose_for(problem.scene, problem.limits, selection, 1e-2)))


def look_at(part: Part, shape: Shape) -> Look:
    """Evaluate a shape."""
    limits, x, wall = part.limits, shape.x, shape.wall
    profile = pin.Profile(tuple(x.tolist()), tuple(part.size(wall).tolist()))
    mass, use, deflection, oval, stress = part.figures(profile)
    margins = [_kept(use, 1.0)]
    for value, limit in (
        (deflection, limits.max_deflection), (oval, limits.max_ovalization), (stress, limits.max_ring_stress)
    ):  # fmt: skip
        if limit is not None:
            margins.append(_kept(value, limit))
    if limits.min_wall > 0.0:
        margins.append(_kept(2.0 * limits.min_wall, float(wall.min())))
    if limits.max_slope is not None and x.size > 1:
        rise, run = np.abs(np.diff(wall)), np.diff(x)
        steep = float(np.max(rise / np.maximum(limits.max_slope * run, 1e-12 * float(wall.max()))))
        margins.append(_kept(steep, 1.0))
    return Look(math.log(mass) if mass > 0.0 else -math.inf, np.array(margins))


def _kept(value: float | None, limit: float) -> float:
    if value is None or not math.isfinite(value) or limit <= 0.0:
        return _MISSED
    return math.log(limit / value) if value > 0.0 else 10.0


@dataclass(frozen=True)
class Way:
    """A parametrisation of a form: bounds, shape, and the answer's parameters."""

    name: str
    space: Space
    shape: Callable[[Array], Shape]
    answer: Array


def ways(part: Part, form: str, steps: int, answer: Shape) -> Iterator[Way]:
    """All parametrisations of a form used by searches; ``answer`` is one half."""
    most = part.thickest if math.isfinite(part.thickest) else _THICKEST * float(answer.wall.max())
    least = min(max(2.0 * part.limits.min_wall, _THINNEST * most), 0.999 * most)
    if form == "constant":
        sizes = np.clip(answer.wall[:1], least, most)
        yield Way("size", Space(np.array([least]), np.array([most])), lambda p: Shape(np.zeros(1), p), sizes)
    elif form == "stepped":
        yield _of_steps(part, steps, answer, least, most)
    elif form in ("double_cone", "cone_cylinder"):
        yield _of_cone(part, form == "cone_cylinder", answer, least, most)
    else:
        yield from _of_waves(part, form == "drillable", answer, least, most)


def _of_steps(part: Part, steps: int, answer: Shape, least: float, most: float) -> Way:
    """Sizes, then positions as fractions of the half."""
    new = np.flatnonzero(np.diff(answer.wall) > 0.0) + 1
    sizes = np.concatenate([answer.wall[:1], answer.wall[new]])[:steps]
    places = (answer.x[new] / part.half)[: steps - 1]
    sizes = np.concatenate([sizes, np.full(steps - sizes.size, sizes[-1])])
    places = np.concatenate([places, np.full(steps - 1 - places.size, 1.0 - _ON_EDGE)])
    lower = np.concatenate([np.full(steps, least), np.full(steps - 1, _ON_EDGE)])
    upper = np.concatenate([np.full(steps, most), np.full(steps - 1, 1.0)])

    def shape(p: Array) -> Shape:
        wall, at = np.maximum.accumulate(p[:steps]), np.sort(p[steps:]) * part.half
        return Shape(np.concatenate([[0.0], np.repeat(at, 2), [part.half]]), np.repeat(wall, 2))

    return Way("steps", Space(lower, upper), shape, np.clip(np.concatenate([sizes, places]), lower, upper))


def _of_cone(part: Part, cylinder: bool, answer: Shape, least: float, most: float) -> Way:
    """t at the end and in the middle, and the cone's fraction of the half."""
    stop = answer.x[np.flatnonzero(answer.wall == answer.wall[-1])[0]] / part.half if cylinder else 1.0
    lower, upper = np.array([least, least, 1e-3 if cylinder else 1.0]), np.array([most, most, 1.0])
    found = np.clip(np.array([answer.wall[0], answer.wall[-1], max(stop, 1e-3)]), lower, upper)

    def shape(p: Array) -> Shape:
        return Shape(np.array([0.0, p[2] * part.half, part.half]), np.array([p[0], p[1], p[1]]))

    return Way("cone", Space(lower, upper), shape, found)


def _of_waves(part: Part, one_way: bool, answer: Shape, least: float, most: float) -> Iterator[Way]:
    """The answer's walls scaled by waves between knots."""
    half, x, wall = part.half, answer.x, answer.wall
    scale = math.exp(_STEEPEST)

    def bent(factors: Array) -> Array:
        knots = np.linspace(0.0, half, factors.size)
        found = np.clip(wall * np.exp(np.interp(x, knots, np.log(factors))), min(least, wall.min()), most)
        return np.maximum.accumulate(found) if one_way else found

    def plain(count: int, *more: tuple[float, float]) -> Space:
        ends = np.array([(1.0 / scale, scale)] * count + list(more))
        return Space(ends[:, 0], ends[:, 1])

    yield Way("waves", plain(_WAVES), lambda p: Shape(x, bent(p)), np.ones(_WAVES))
    if one_way:

        def thick_middle(p: Array) -> Shape:
            return _with_collar(Shape(x, bent(p[:_FEW])), p[_FEW] * half, half, min(p[_FEW + 1], most))

        space = plain(_FEW, (_ON_EDGE, 1.0), (least, most))
        yield Way("waves and a stiff middle", space, thick_middle, np.array([*np.ones(_FEW), 1.0, wall.max()]))
        return

    def unlike(p: Array) -> Shape:
        left, right = bent(p[:_WAVES]), bent(p[_WAVES:])
        return Shape(np.concatenate([x, 2.0 * half - x[::-1]]), np.concatenate([left, right[::-1]]))

    def collar(p: Array) -> Shape:
        begin, length = p[_FEW] * half, p[_FEW + 1] * half
        return _with_collar(Shape(x, bent(p[:_FEW])), begin, min(begin + length, half), min(p[_FEW + 2], most))

    if part.limits.max_slope is None:
        space = plain(_FEW, (_ON_EDGE, 1.0), (_ON_EDGE, 1.0), (least, most))
        yield Way("waves and a collar", space, collar, np.array([*np.ones(_FEW), 1.0, _ON_EDGE, wall.max()]))
    yield Way("halves unlike", plain(2 * _WAVES), unlike, np.ones(2 * _WAVES))


def _with_collar(shape: Shape, begin: float, end: float, wall: float) -> Shape:
    """Enforce a minimum wall over an interval, with a step at each end."""
    x, own = shape.x, shape.wall
    places = np.array([p for p in (begin, end) if x[0] < p < x[-1]])
    if not begin < end or not places.size:
        return shape
    at = np.interp(places, x, own)
    raised = np.where((x > begin) & (x < end), np.maximum(own, wall), own)
    # Of two coincident points, the original one lies outside.
    outside = np.where(places == begin, -1, 1)
    order = np.lexsort((np.concatenate([np.zeros(x.size), outside, -outside]), np.concatenate([x, places, places])))
    return Shape(
        np.concatenate([x, places, places])[order], np.concatenate([raised, at, np.maximum(at, wall)])[order]
    )  # fmt: skip


@dataclass(frozen=True)
class Best:
    """Result of a search in one parametrisation: the best feasible shape, None if there is none."""

    shape: Shape | None
    by: str
    tried: int


def rival_shapes(
    part: Part, form: str, steps: int, answer: Shape, strength: Strength, rng: np.random.Generator
) -> Iterator[Best]:
    """The best of every parametrisation; ``strength`` is shared among them."""
    found = list(ways(part, form, steps, answer))
    starts = max(strength.starts // len(found), 2)
    for way in found:
        hunt = Hunt(way.space, lambda sizes, way=way: look_at(part, way.shape(sizes)))
        first = hunt.clipped(np.log(way.answer))
        near = [first, *along(hunt, first, rng, max(starts // 4, 1))]
        step_along_limits(hunt, first)
        far = [_drawn(way, first, rng) for _ in range(starts - len(near))]
        compete(hunt, near, far, replace(strength, starts=starts, most=strength.most // len(found)))
        shape = None if hunt.best is None else way.shape(hunt.best[1])
        yield Best(shape, f"{way.name}, {hunt.found_by}", hunt.evaluations)


def _drawn(way: Way, first: Array, rng: np.random.Generator) -> Array:
    """Random parameters around the answer, or anywhere."""
    low, high = np.log(way.space.lower), np.log(way.space.upper)
    if rng.random() < 0.5:
        return np.clip(first + 10 ** rng.uniform(-3.0, 0.0) * rng.standard_normal(first.size), low, high)
    return rng.uniform(np.maximum(low, first - 3.0), np.minimum(high, first + 3.0))
