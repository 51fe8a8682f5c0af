"""Reference for the check of a strip: extremes of ``solvers.references.rod`` over angles and sections, fatigue safety
along the ray to the limiting curve, mean friction power by quadrature."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import mpmath as mp

from solvers.references.rod import Case, Machine, natural_frequency
from solvers.references.searching import Number, brent, find_root, gauss

DIGITS = 34

Utilisation = Callable[[Number, Number], Number]
"""Utilisation 1/n of a stress cycle, from its maximum and minimum stress."""

_SECTIONS = tuple(mp.mpf(i) / 12 for i in range(13)) + tuple(
    side for k in (2, 3) for side in (mp.mpf(10) ** -k, 1 - mp.mpf(10) ** -k)
)
_REFINEMENT = mp.mpf(10) ** -10
_CANDIDATE_RANGE = mp.mpf("0.05")
_CANDIDATE_FRACTION = mp.mpf("0.97")
_QUICK, _CHECKED = 12, 18


def utilisation(name: str, material: Mapping[str, Any]) -> Utilisation:
    """Utilisation by a fatigue criterion, from the intersection of the cycle's ray with the limiting curve.

    A compressive mean stress gives no benefit.

    serensen, soderberg, goodman: straight lines; gerber: a parabola; fkm: slope M up to R = 0, M/3 up to R = 1/2,
    constant beyond. The amplitude is multiplied by K.
    """
    limit, k, psi = (mp.mpf(material[n]) for n in ("fatigue_limit", "fatigue_reduction", "mean_stress_sensitivity"))

    def straight(slope: Number) -> Utilisation:
        return lambda high, low: k * (high - low) / 2 / limit + max((high + low) / 2, 0) * slope

    def gerber(high: Number, low: Number) -> Number:
        # n a + (n m)^2 = 1, solved for n.
        a, m = k * (high - low) / 2 / limit, max((high + low) / 2, 0) / mp.mpf(material["ultimate_strength"])
        return a if m == 0 else 2 * m * m / (mp.sqrt(a * a + 4 * m * m) - a)

    def fkm(high: Number, low: Number) -> Number:
        a, m = k * (high - low) / 2, (high + low) / 2
        if m <= 0:
            return a / limit
        if m <= a:
            return (a + psi * m) / limit
        kept = (1 + psi) / (1 + psi / 3)
        return kept * (a + psi / 3 * m) / limit if m <= 3 * a else kept * (1 + psi) * a / limit

    if name in ("gerber", "fkm"):
        return {"gerber": gerber, "fkm": fkm}[name]
    if name == "serensen":
        return straight(psi / limit)
    return straight(1 / mp.mpf(material["yield_strength" if name == "soderberg" else "ultimate_strength"]))


STRESSES = ("fatigue_safety", "stress_amplitude", "yield_safety")


def check(
    case: Case, criterion: str, watch: Callable[[], None], wanted: Container[str]
) -> dict[str, tuple[Number | None, float]]:
    """name -> (value in SI units, relative uncertainty) of a strip in its machine; costly results only if ``wanted``.

    A safety without a load is None; a buckled strip has no stresses. Extremes are located on graded grids of angles and
    sections and refined with Brent's method.
    """
    with mp.workdps(DIGITS):
        machine = Machine(case)
        x, angles = machine.x, machine.angles()
        cycle = _Cycle(watch, angles)
        low, uncertainty_low = cycle.maximum(lambda phi: -machine.force(phi))
        high, uncertainty_high = cycle.maximum(machine.force)
        critical, frequency = machine.critical_force(), natural_frequency(machine, machine.mean_force(), watch)
        found: dict[str, tuple[Number | None, float]] = {
            "axial_force_min": (-low, uncertainty_low),
            "axial_force_max": (high, uncertainty_high),
            "critical_force": (critical, 0.0),
            "stability_safety": (critical / low if low > 0 else None, uncertainty_low),
            "mass": (x["density"] * x["b"] * x["h"] * x["l"], 0.0),
            "natural_frequency": (frequency, 0.0),
        }
        if low > 0 and critical <= low:
            return found
        if any(name in wanted for name in STRESSES):
            found |= _stresses(machine, utilisation(criterion, case["material"]), cycle)
        for name, value in (
            ("side_force_max", lambda phi: abs(machine.side_force(phi))),
            ("clamp_moment_max", lambda phi: abs(machine.clamp_moment(phi))),
            ("contact_pressure_max", machine.contact_pressure),
        ):
            if name in wanted:
                found[name] = cycle.maximum(value)
        if "friction_power" in wanted:
            found["friction_power"] = _power(machine, cycle)
        return found


class _Cycle:
    """Crank angles of the cycle, over which maxima are determined."""

    def __init__(self, watch: Callable[[], None], angles: Sequence[Number]) -> None:
        self.watch, self.angles = watch, angles

    def maximum(self, f: Callable[[Number], Number]) -> tuple[Number, float]:
        """(maximum of f over the cycle, relative uncertainty)."""
        values = []
        for angle in self.angles:
            self.watch()
            values.append(f(angle))
        n, top = len(values), max(values)
        spread, best, uncertainty = top - min(values), top, mp.mpf(0)
        if spread == 0:
            return top, 0.0
        for i in range(n):
            if values[i] < top - _CANDIDATE_RANGE * spread or values[i] < max(values[i - 1], values[(i + 1) % n]):
                continue
            left = self.angles[i - 1] - (2 * mp.pi if i == 0 else 0)
            right = self.angles[(i + 1) % n] + (2 * mp.pi if i == n - 1 else 0)
            found, error = self.refined(f, left, self.angles[i], right)
            if found > best:
                best, uncertainty = found, error
        return best, float(uncertainty / abs(best)) if best else 0.0

    def refined(self, f: Callable[[Number], Number], a: Number, m: Number, b: Number) -> tuple[Number, Number]:
        """(maximum, its uncertainty: the decrease over the last step); at a corner, with a much smaller last step."""

        def watched(position: Number) -> Number:
            self.watch()
            return f(position)

        width, share = b - a, _REFINEMENT
        position, value = brent(watched, a, m, b, width * share)
        for _ in range(2):
            near = width * share * 100
            decrease = max(value - watched(max(position - near, a)), value - watched(min(position + near, b)))
            if abs(decrease) <= mp.mpf(10) ** -12 * abs(value) or share < _REFINEMENT:
                break
            low, high = max(position - 2 * near, a), min(position + 2 * near, b)
            share *= _REFINEMENT
            position, value = brent(watched, low, position, high, width * share)
        # At 100 times the step the decrease of a parabola is 1e4 times as large, that at a corner 100 times.
        return value, abs(decrease) / (100 if share < _REFINEMENT else 10_000)


def _stresses(machine: Machine, criterion: Utilisation, cycle: _Cycle) -> dict[str, tuple[Number | None, float]]:
    """Fatigue and yield safety, and the stress amplitude at the section that governs fatigue."""
    rows = [[_fibres(machine, share, phi, cycle.watch) for phi in cycle.angles] for share in sorted(_SECTIONS)]
    value, uncertainty, amplitude, amplitude_uncertainty = _worst(machine, criterion, rows, cycle)
    found: dict[str, tuple[Number | None, float]] = {
        "fatigue_safety": (1 / value if value > 0 else None, uncertainty),
        "stress_amplitude": (amplitude, amplitude_uncertainty),
    }
    value, uncertainty, _, _ = _worst(machine, lambda high, low: max(high, -low), rows, cycle)
    found["yield_safety"] = (machine.x["yield_strength"] / value if value > 0 else None, uncertainty)
    return found


def _fibres(machine: Machine, share: Number, phi: Number, watch: Callable[[], None]) -> tuple[Number, Number]:
    watch()
    direct = machine.force(phi) / (machine.x["b"] * machine.x["h"])
    bending = machine.stress(share, phi, 1) - direct
    return direct + bending, direct - bending


def _worst(
    machine: Machine, criterion: Utilisation, rows: list[list[tuple[Number, Number]]], cycle: _Cycle
) -> tuple[Number, float, Number, float]:
    """Maximum utilisation over sections and fibres and its uncertainty, the amplitude there and its uncertainty."""
    sections, best = sorted(_SECTIONS), None
    coarse = {
        (layer, i): criterion(max(s[layer] for s in row), min(s[layer] for s in row))
        for layer in (0, 1)
        for i, row in enumerate(rows)
    }
    top, last = max(coarse.values()), len(sections) - 1
    for (layer, i), value in coarse.items():
        neighbours = [coarse[layer, j] for j in (i - 1, i + 1) if 0 <= j <= last]
        if value < top * _CANDIDATE_FRACTION or value < max(neighbours):
            continue
        section = cache(lambda share, fibre=1 - 2 * layer: _section(machine, share, fibre, cycle))

        def utilisation_at(share: Number, of: Any = section) -> Number:
            return criterion(*of(share)[:2])

        low, high = sections[max(i - 1, 0)], sections[min(i + 1, last)]
        candidates = [(utilisation_at(sections[i]), sections[i], mp.mpf(0))]
        inward = sections[i] + (high - low) / 1000 * (1 if i == 0 else -1)
        # an end from which the utilisation decreases is the maximum; refine only if it increases inward
        if 0 < i < last or utilisation_at(inward) > candidates[0][0]:
            middle = sections[i] if 0 < i < last else (low + high) / 2
            position, value = brent(utilisation_at, low, middle, high, (high - low) * mp.mpf(10) ** -8)
            candidates.append((value, position, (high - low) * mp.mpf(10) ** -8))
        for value, position, step in candidates:
            if best is None or value > best[0]:
                best = (value, position, step, section)
    value, position, step, section = best
    high, low, uncertainty = section(position)
    amplitude, amplitude_uncertainty = (high - low) / 2, mp.mpf(0)
    if step:
        other = section(min(position + step, mp.mpf(1)))
        amplitude_uncertainty = abs((other[0] - other[1]) / 2 - amplitude) * 10
        uncertainty += abs(criterion(other[0], other[1]) - value)
    relative = float(uncertainty / value) if value else 0.0
    return value, relative, amplitude, float(amplitude_uncertainty / amplitude) + relative if amplitude else 0.0


def _section(machine: Machine, share: Number, fibre: int, cycle: _Cycle) -> tuple[Number, Number, Number]:
    """Maximum and minimum stress at a section, and their combined uncertainty relative to the larger one."""
    stress = cache(lambda phi: machine.stress(share, phi, fibre))
    high, first = cycle.maximum(stress)
    low, second = cycle.maximum(lambda phi: -stress(phi))
    return high, -low, (first + second) * max(abs(high), abs(low)) / machine.x["fatigue_limit"]


def _power(machine: Machine, cycle: _Cycle) -> tuple[Number, float]:
    """Mean friction power over the cycle, on intervals that end at the integrand's corners."""

    def moment(phi: Number) -> Number:
        return machine.clamp_moment(phi) + machine.side_force(phi) * machine.x["clamp_offset"]

    def excess(phi: Number) -> Number:
        return machine.couple(phi) - abs(machine.side_force(phi))

    ends = {mp.mpf(0), mp.pi, 2 * mp.pi, *(mp.pi * i / 4 for i in range(8))}
    smooth = {2 * mp.pi * i / 72 for i in range(72)}
    ends |= set(cycle.angles) - smooth
    inside = [a for a in cycle.angles if mp.sin(a) != 0]
    for low, high in pairwise(inside):
        cycle.watch()
        if mp.sin(low) * mp.sin(high) <= 0:
            continue
        for f in (excess, machine.side_force, moment):
            if f(low) * f(high) < 0:
                ends.add(find_root(f, low, high))
        # around a zero of the moment only one wall is in contact, however narrow that interval is
        if moment(low) * moment(high) < 0 < excess(low) and excess(high) > 0:
            middle = find_root(moment, low, high)
            ends |= {find_root(excess, low, middle), find_root(excess, middle, high)}
    found = []
    for order in (_QUICK, _CHECKED):
        total = mp.mpf(0)
        for low, high in pairwise(sorted(ends)):
            cycle.watch()
            total += mp.fsum(machine.friction_power(phi) * weight for phi, weight in gauss(low, high, order))
        found.append(total / (2 * mp.pi))
    return found[1], float(abs(found[1] - found[0]) / abs(found[1])) if found[1] else 0.0
