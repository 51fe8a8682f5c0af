"""The moving strip by Galerkin's method along it and collocation at Radau's points in time, the whole motion at once.

    EI V'''' - P(phi) V'' + rho A omega^2 V_phiphi = 0,  V(l) + e V'(l) = r sin(phi),  M(L) = 0,  V periodic

V = s g(z) + sum y_k psi_k(z), with second derivatives of g and psi_k that are Legendre's polynomials, orthogonal to one
another, so that the only forcing is s_phiphi = -s; the quasi-static shape is not separated. Where shear adds its own
deflection delta to the quasi-static shape, -rho A omega^2 delta_phiphi drives the strip as well, by the derivative of
its polynomial through the points of an element. A loss factor eta damps what the strip does beside the quasi-static
motion y_s, K y_s = -s P int g' psi' dz, by C (y - y_s)' with C = eta M Phi Omega Phi^T M, Phi the modes under the mean
force with Phi^T M Phi = 1 and Omega their frequencies. The periodic start follows from the elements' transfer matrices.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import eigh

from solvers.rod.scene import Dimensions, Scene

Array = NDArray[np.float64]
TURN = 2.0 * math.pi
FUNCTIONS, STAGES = 18, 9
LEAST_ELEMENTS, MOST_ELEMENTS = 96, 1500
_FOLLOWED, _RINGING, _RADIANS = 2, 4, 4.0
"""The elements are so narrow that mode ``_FOLLOWED`` (after a corner of the force mode ``_RINGING``) turns by at most
``_RADIANS`` in one, as far as the number of elements permits."""
_AT_ONCE = 50


class Driven(Protocol):
    """Interface of the moving strip's model: a dataclass that can be copied with fewer ``effects``."""

    scene: Scene
    strip: Dimensions
    effects: frozenset[str]
    stiffness: float
    compliance: float
    head: float

    def still(self, angle: Array) -> Any:
        """The quasi-static shape at angles."""

    def bent(self, angle: Array, force: Array | None = None) -> Any:
        """The shape under all effects, or under a given force."""

    def deflection(self, bent: Any, z: Array) -> Array: ...

    def force_corners(self) -> Array:
        """Angles at which the axial force or a derivative of it jumps."""

    def axial_force(self, angle: Array) -> Array: ...

    def lateral(self, angle: Array) -> Array: ...


@dataclass(frozen=True)
class Basis:
    """Series in Legendre's polynomials over the strip, (functions + 1, terms): V''; the last function is g."""

    length: float
    second: Array

    @staticmethod
    def of(length: float, head: float, functions: int) -> Basis:
        own = np.diag(np.sqrt((2.0 * np.arange(functions + 1) + 1.0) / length))
        # Only the first two polynomials move the pin: one combination of them leaves it at rest, the other one is g.
        whole = Basis(length, own[:2])
        ends = np.array([length])
        moved = whole.values(ends, 0)[0] + head * whole.values(ends, 1)[0]
        own[:2] = np.array([[moved[1], -moved[0]], [moved[0], moved[1]]]) @ own[:2]
        own[0] /= math.hypot(*moved)
        own[1] /= moved @ moved
        return Basis(length, own[[0, *range(2, functions + 1), 1]])

    def values(self, z: Array, order: int) -> Array:
        """Derivatives 0 … 3 at z, (z, functions + 1)."""
        x, scale = 2.0 * z / self.length - 1.0, 0.5 * self.length
        series = self.second.T
        for _ in range(2 - order):
            series = legendre.legint(series, lbnd=-1.0) * scale
        if order == 3:
            series = legendre.legder(series) / scale
        return legendre.legval(x, series).T


@dataclass(frozen=True)
class PeriodicMotion:
    """Amplitudes of the functions (g's is the lateral displacement) at 1 + STAGES points of every element."""

    basis: Basis
    edges: Array
    points: Array
    amplitudes: Array

    def amplitude(self, angle: Array) -> Array:
        """(functions + 1, angles), by the polynomial through an element's points."""
        at = np.mod(angle - self.edges[0], TURN) + self.edges[0]
        element = np.clip(np.searchsorted(self.edges, at, side="right") - 1, 0, self.edges.size - 2)
        x = (at - self.edges[element]) / np.diff(self.edges)[element]
        gaps = x[:, None] - self.points
        pairs = self.points[:, None] - self.points + np.eye(self.points.size)
        weights = np.stack(
            [np.delete(gaps, j, axis=1).prod(axis=1) / pairs[j].prod() for j in range(self.points.size)], axis=1
        )
        return np.einsum("as,asf->fa", weights, self.amplitudes[element])

    def curvature(self, angle: Array, z: Array) -> Array:
        """V'' [1/m] at sections (scalar or (sections, 1)) and angles."""
        found = self.basis.values(np.ravel(z).astype(float), 2) @ self.amplitude(angle)
        return found if np.ndim(z) else found[0]

    def at_clamp(self, angle: Array) -> tuple[Array, Array]:
        """V''(0) and V'''(0)."""
        amplitude, start = self.amplitude(angle), np.zeros(1)
        return self.basis.values(start, 2)[0] @ amplitude, self.basis.values(start, 3)[0] @ amplitude


def radau(stages: int) -> tuple[Array, Array]:
    """Radau's points in (0, 1], and the matrix that integrates polynomials through them from 0."""
    series = np.zeros(stages + 1)
    series[stages], series[stages - 1] = 1.0, -1.0
    x = np.sort(legendre.legroots(series).real)
    x[-1] = 1.0
    vander = legendre.legvander(x, stages - 1)
    integral = np.stack([legendre.legval(x, legendre.legint(c, lbnd=-1.0)) for c in np.eye(stages)], axis=1)
    return 0.5 * (x + 1.0), 0.5 * integral @ np.linalg.inv(vander)


def periodic_motion(
    model: Driven, functions: int = FUNCTIONS, stages: int = STAGES, elements: int | None = None
) -> PeriodicMotion:
    """The periodic motion of a model's strip under its axial force."""
    scene, strip, e = model.scene, model.strip, model.head
    basis = Basis.of(strip.l, e, functions)
    nodes, weights = legendre.leggauss(functions + 12)
    z, weights = 0.5 * strip.l * (nodes + 1.0), 0.5 * strip.l * weights
    shapes, slopes, end = basis.values(z, 0), basis.values(z, 1), basis.values(np.array([strip.l]), 1)
    mass = scene.material.density * strip.b * strip.h * (TURN * scene.mechanism.speed) ** 2
    inertia = mass * (shapes.T * weights) @ shapes
    geometric = (slopes.T * weights) @ slopes + e * end.T @ end
    n, own = functions, slice(0, functions)

    corners = model.force_corners()
    mean = _mean_force(model, corners)
    squares, modes = eigh(model.stiffness * np.eye(n) + mean * geometric[own, own], inertia[own, own])
    borne = inertia[own, own] @ modes
    damping = scene.material.loss_factor * (borne * np.sqrt(squares)) @ borne.T
    if elements is None:
        pace = squares[(_RINGING if corners.size else _FOLLOWED) - 1]
        elements = int(np.clip(TURN * math.sqrt(pace) / _RADIANS, LEAST_ELEMENTS, MOST_ELEMENTS))
    ends = np.unique(np.concatenate([[0.0], corners, [TURN]]))
    edges = np.unique(np.concatenate([
        np.linspace(a, b, math.ceil(elements * (b - a) / TURN) + 1) for a, b in pairwise(ends)
    ]))  # fmt: skip
    c, once = radau(stages)
    points = np.concatenate([[0.0], c])
    width = np.diff(edges)
    angle = edges[:-1, None] + width[:, None] * points
    force = model.axial_force(angle.ravel()).reshape(angle.shape)
    lateral = model.lateral(angle)

    right = lateral[:, 1:, None] * (inertia[own, n] - force[:, 1:, None] * geometric[own, n])
    if model.compliance:
        right -= _shear_forcing(model, angle, width, points, z, mass * shapes[:, own] * weights[:, None])
    stiff = model.stiffness * np.eye(n) + force[..., None, None] * geometric[own, own]
    if scene.material.loss_factor:
        pulled = -(lateral * force)[..., None] * geometric[own, n]
        right += _slope(np.linalg.solve(stiff, pulled[..., None])[..., 0], points, width)[:, 1:] @ damping
    size, some = edges.size - 1, range(0, edges.size - 1, _AT_ONCE)
    parts = [
        _transfers(
            c, once, width[i : i + _AT_ONCE], inertia[own, own],
            damping, stiff[i : i + _AT_ONCE, 1:], right[i : i + _AT_ONCE],
        )
        for i in some
    ]  # fmt: skip
    moved, sped = (np.concatenate(part) for part in zip(*parts, strict=True))
    step = np.concatenate([moved[:, -1], sped], axis=1)

    closed = np.eye(2 * n + 1)[: 2 * n]
    for transfer in step:
        closed = transfer[:, :-1] @ closed
        closed[:, -1] += transfer[:, -1]
    start = np.linalg.solve(np.eye(2 * n) - closed[:, :-1], closed[:, -1])
    amplitudes = np.empty((size, stages + 1, n + 1))
    amplitudes[..., n] = lateral
    for i in range(size):
        state = np.append(start, 1.0)
        amplitudes[i, 0, :n], amplitudes[i, 1:, :n] = start[:n], moved[i] @ state
        start = step[i] @ state
    return PeriodicMotion(basis, edges, points, amplitudes)


def _mean_force(model: Driven, corners: Array) -> float:
    """The mean axial force [N], by Gauss's rule between its corners."""
    ends = np.unique(np.concatenate([np.linspace(0.0, TURN, 33), corners]))
    nodes, weights = legendre.leggauss(8)
    angle = ends[:-1, None] + 0.5 * np.diff(ends)[:, None] * (nodes + 1.0)
    force = model.axial_force(angle.ravel()).reshape(angle.shape)
    return float(np.diff(ends) @ (force @ weights)) / (2.0 * TURN)


def _slope(values: Array, points: Array, width: Array) -> Array:
    """Derivatives of (elements, points, …) by the polynomial through an element's points."""
    x = 2.0 * points - 1.0
    vander = legendre.legvander(x, x.size - 1)
    first = np.stack([legendre.legval(x, legendre.legder(c)) for c in np.eye(x.size)], axis=1)
    return np.einsum("ij,ej...->ei...", 2.0 * first @ np.linalg.inv(vander), values) / width[:, None, None]


def _transfers(
    c: Array, once: Array, width: Array, mass: Array, damping: Array, stiff: Array, right: Array
) -> tuple[Array, Array]:
    """M y'' + C y' + K(phi) y = right on elements: y at the points and y' at the end, linear in the start's y and y'
    with a column for the driving term, (elements, points, functions, 2 functions + 1) and (elements, functions, 2
    functions + 1)."""
    (size, stages, n), twice = right.shape, once @ once
    system = np.einsum("ij,eiab->eiajb", twice, stiff) * (width**2)[:, None, None, None, None]
    system += np.einsum("ij,ab->iajb", once, damping) * width[:, None, None, None, None]
    system = system.reshape(size, stages * n, stages * n) + np.kron(np.eye(stages), mass)
    columns = np.zeros((size, stages, n, 2 * n + 1))
    columns[..., :n] = -stiff
    columns[..., n : 2 * n] = -stiff * (width[:, None] * c)[..., None, None] - damping
    columns[..., -1] = right
    acceleration = np.linalg.solve(system, columns.reshape(size, stages * n, -1)).reshape(columns.shape)
    moved = np.einsum("ij,ejab->eiab", twice, acceleration) * (width**2)[:, None, None, None]
    moved[..., :n] += np.eye(n)
    moved[..., n : 2 * n] += np.eye(n) * (width[:, None] * c)[..., None, None]
    sped = np.einsum("j,ejab->eab", once[-1], acceleration) * width[:, None, None]
    sped[..., n : 2 * n] += np.eye(n)
    return moved, sped


def _shear_forcing(model: Driven, angle: Array, width: Array, points: Array, z: Array, weighted: Array) -> Array:
    """int rho A omega^2 psi delta_phiphi dz at the elements' points but the first."""
    still = model.still(angle.ravel())
    rigid = replace(model, effects=frozenset())
    added = model.deflection(still, z[:, None])
    added -= rigid.deflection(rigid.bent(still.angle, still.force), z[:, None])
    added = (weighted.T @ added).reshape(-1, *angle.shape)
    x = 2.0 * points - 1.0
    vander = legendre.legvander(x, x.size - 1)
    second = np.stack([legendre.legval(x, legendre.legder(c, 2)) for c in np.eye(x.size)], axis=1)
    second = 4.0 * second @ np.linalg.inv(vander)
    return (np.einsum("ij,fej->eif", second, added) / width[:, None, None] ** 2)[:, 1:]
