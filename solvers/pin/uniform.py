"""Bending and shear deflection of a solid pin under the rod force, in closed form.

With M and Q of ``load.piston_pin`` and the unit load m = (x - a)/2, q = 1/2 up to the middle,

    integral of M m = P [a delta^2/24 + delta^3/12 + c (delta h + h^2/2)/2 + delta b^2/48 + 5 b^3/768],
    integral of Q q = P [delta/4 + b/16],        c = a/6 + delta/2,  h = b/2,
"""

from __future__ import annotations

from solvers.pin.scene import Scene


def deflection_parts(scene: Scene) -> tuple[float, float]:
    """Return the bending and shear deflection of the solid pin [m]: B and S of B/v(u) + S phi(u)."""
    g, m = scene.geometry, scene.material
    a, b, gap, h = g.boss_length, g.small_end_length, g.gap, 0.5 * g.small_end_length
    carried = a / 6.0 + 0.5 * gap
    bend = a * gap**2 / 24.0 + gap**3 / 12.0 + 0.5 * carried * (gap * h + 0.5 * h * h)
    bend += gap * b * b / 48.0 + 5.0 * b**3 / 768.0
    shear = 0.25 * gap + b / 16.0
    bent = 2.0 * scene.force * bend / (m.elastic_modulus * g.inertia)
    return bent, 2.0 * scene.force * shear / (m.shear_modulus * g.area)
