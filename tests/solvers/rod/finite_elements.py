"""An independent model of the vibrating strip: Hermite beam elements, periodic collocation in time."""

from __future__ import annotations

import numpy as np

from solvers.rod.strip.stiffness import bending_stiffness


def matrices(length, rod_length, elements=40):
    """Bending, geometric and mass matrix per unit EI, P, rho A; free freedoms; response to a unit lateral displacement.

    The last node's deflection is s - e theta, so the freedoms are all inner ones and the end's turn.
    """
    n, h, e = elements, length / elements, rod_length - length
    size = 2 * (n + 1)
    bending, geometric, mass = np.zeros((3, size, size))
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h]])
    k = np.vstack([k, [[-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]]) / h**3
    g = np.array([[36, 3 * h, -36, 3 * h], [3 * h, 4 * h * h, -3 * h, -h * h]])
    g = np.vstack([g, [[-36, -3 * h, 36, -3 * h], [3 * h, -h * h, -3 * h, 4 * h * h]]]) / (30 * h)
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h]])
    m = np.vstack([m, [[54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]]) * h / 420
    for i in range(n):
        part = slice(2 * i, 2 * i + 4)
        bending[part, part] += k
        geometric[part, part] += g
        mass[part, part] += m
    geometric[-1, -1] += e
    free = np.zeros((size, size - 3))
    free[2 : size - 2, : size - 4] = np.eye(size - 4)
    free[size - 1, size - 4], free[size - 2, size - 4] = 1.0, -e
    lateral = np.zeros(size)
    lateral[size - 2] = 1.0
    return bending, geometric, mass, free, lateral


def vibration(scene, dimensions, angles, force, elements=40, modes=12):
    """Deflection beyond the quasi-static one at the nodes, (nodes, angles), by collocation at uniform angles."""
    _, departure, _ = periodic_field(scene, dimensions, angles, force, elements, modes)
    return departure[:, ::2].T


def periodic_field(scene, dimensions, angles, force, elements, modes):
    """The quasi-static field, what the strip departs from it and the whole's second derivative, (angles, freedoms)."""
    from scipy.linalg import eigh

    bending, geometric, mass, free, unit = matrices(dimensions.l, scene.mechanism.rod_length, elements)
    line = scene.material.density * dimensions.b * dimensions.h * scene.mechanism.angular_speed**2
    stiffness, count = bending_stiffness(scene, dimensions), angles.size
    lateral = scene.mechanism.crank_radius * np.sin(angles)
    squares, vectors = eigh(
        free.T @ (stiffness * bending + force.mean() * geometric) @ free, line * free.T @ mass @ free
    )
    vectors, squares = vectors[:, :modes], squares[:modes]
    softening = vectors.T @ free.T @ geometric @ free @ vectors
    order = np.fft.fftfreq(count, 1 / count)
    second = np.real(np.fft.ifft(-(order**2)[:, None] * np.fft.fft(np.eye(count), axis=0), axis=0))
    moving = np.kron(np.eye(count), np.diag(squares)) + np.kron(second, np.eye(modes))
    moving += np.kron(np.diag(force - force.mean()), softening)
    # The quasi-static shape from every freedom, so that only the smooth departure from it is left to few modes.
    still = np.empty((count, unit.size))
    for i in range(count):
        system = stiffness * bending + force[i] * geometric
        free_part = np.linalg.solve(free.T @ system @ free, -free.T @ system @ unit)
        still[i] = (free @ free_part + unit) * lateral[i]
    right = -line * (second @ still) @ mass @ free @ vectors
    departure = np.linalg.solve(moving, right.ravel()).reshape(count, modes)
    departure = departure @ (free @ vectors).T
    return still, departure, second @ (still + departure)
