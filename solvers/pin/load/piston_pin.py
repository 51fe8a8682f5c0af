"""Load of the piston pin, axial positions of its segments, and deflection reference."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.pin.load.macaulay import LoadCase, MacaulayTerm


@dataclass(frozen=True)
class DeflectionReference:
    """Deflection at the midpoint of two points, relative to the chord through them.

    ``residual`` is the rounding residual of ``right``.
    """

    left: float
    right: float
    residual: float = 0.0


def piston_pin_case(force: float, boss_length: float, small_end_length: float, gap: float) -> LoadCase:
    """Return the pin's load: uniform in the rod's small end, triangular in each boss with its peak at the inner
    edge.

    Q(x) = P/(2a^2)(<x>^2 - <x-a>^2) - (P/a)<x-a> - (P/b)(<x-x1> - <x-x2>) + (P/a)<x-x3> - (P/(2a^2))<x-x3>^2,
    x1 = a + delta, x2 = x1 + b, x3 = x2 + delta. The moment in the middle is the textbook's
    P (L + 2(b + 2 delta) - 1.5 b)/12. Source: the paper's equations (4) and (5), after figure 2.
    """
    a, b = boss_length, small_end_length
    _, (x1, residual1), _, (x2, residual2), (x3, residual3), _ = pin_places(a, b, gap)
    ramp, boss, rod = force / (2.0 * a * a), force / a, force / b
    return LoadCase(
        (
            MacaulayTerm(ramp, 0.0, 2),
            MacaulayTerm(-ramp, a, 2),
            MacaulayTerm(-boss, a, 1),
            MacaulayTerm(-rod, x1, 1, residual=residual1),
            MacaulayTerm(rod, x2, 1, residual=residual2),
            MacaulayTerm(boss, x3, 1, residual=residual3),
            MacaulayTerm(-ramp, x3, 2, residual=residual3),
        )
    )


def deflection_integrals(force: float, boss_length: float, small_end_length: float, gap: float) -> tuple[float, float]:
    """Return the integrals of M m [N m^3] and Q q [N m] along the pin, m and q as in ``write_deflection_coefficients``.

    2 P [a delta^2/24 + delta^3/12 + c (delta h + h^2/2)/2 + delta b^2/48 + 5 b^3/768] and 2 P [delta/4 + b/16], with
    c = a/6 + delta/2 and h = b/2.
    """
    a, b, h = boss_length, small_end_length, 0.5 * small_end_length
    bend = a * gap**2 / 24.0 + gap**3 / 12.0 + 0.5 * (a / 6.0 + 0.5 * gap) * (gap * h + 0.5 * h * h)
    bend += gap * b * b / 48.0 + 5.0 * b**3 / 768.0
    return 2.0 * force * bend, 2.0 * force * (0.25 * gap + b / 16.0)


@kernel
def write_deflection_coefficients(
    x: Array, residual: Array, panel_start: Array, left: float, right: float, right_residual: float, moment: Array,
    shear: Array, length: float, bending_stiffness: float, shear_stiffness: float, bending: Array, sheared: Array,
) -> None:  # fmt: skip
    """Write M m length/bending_stiffness into ``bending`` and Q q length/shear_stiffness into ``sheared`` [m].

    m and q are moment and shear of a unit force at the midpoint, (x - left)/2 and 1/2 up to the middle, then mirrored.
    The result is 0 outside the span, and where a load lifts the middle. A station at an end of the span counts as
    inside only if its panel, which begins at ``panel_start``, lies inside.
    """
    for i in range(x.size):
        bending[i] = sheared[i] = 0.0
        if left <= panel_start[i] < right and x[i] <= right:
            arm = max(0.5 * min(x[i] - left + residual[i], right - x[i] + (right_residual - residual[i])), 0.0)
            sign = 0.5 if x[i] <= 0.5 * (left + right) else -0.5
            bending[i] = max(moment[i] * arm / bending_stiffness, 0.0) * length
            sheared[i] = max(shear[i] * sign / shear_stiffness, 0.0) * length


@lru_cache(maxsize=256)
def pin_places(boss_length: float, small_end_length: float, gap: float) -> tuple[tuple[float, float], ...]:
    """Return the ends of boss, gap, half small end, small end, gap and pin, each with its rounding residual.

    Without the residuals a short small end next to a long boss would lose significant digits.
    """
    boss = (boss_length, 0.0)
    rod = _compensated_sum(boss, gap)
    middle = _compensated_sum(rod, 0.5 * small_end_length)
    rod_end = _compensated_sum(rod, small_end_length)
    far_boss = _compensated_sum(rod_end, gap)
    return boss, rod, middle, rod_end, far_boss, _compensated_sum(far_boss, boss_length)


def _compensated_sum(place: tuple[float, float], length: float) -> tuple[float, float]:
    """Add a length to a compensated position, with Knuth's error-free sum applied twice."""
    total = place[0] + length
    part = total - place[0]
    residual = place[1] + ((place[0] - (total - part)) + (length - part))
    rounded = total + residual
    return rounded, residual - (rounded - total)
