"""One revolution of a strip with shape corrections, sampled on panels; the counterpart of ``sampling``, which has no
corrections.

Ringing of the strip after corners is not resolved by panels but represented in closed form
(``solvers.numerics.ripple``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.fatigue.kernels import Diagram
from solvers.numerics.arrays import Array
from solvers.numerics.legendre import legendre_at
from solvers.numerics.panels import Panels, Rule, inside, panel_errors, resolve, rule_of, split, values_at
from solvers.numerics.periodic import TURN
from solvers.numerics.radau import radau
from solvers.numerics.ripple import amplitude_bounds, no_ripple, ripple_at
from solvers.rod.cycle.composition import Cycle
from solvers.rod.cycle.field_results import field_results
from solvers.rod.cycle.guide_loads import Guide, friction_power, guide_of
from solvers.rod.cycle.sampling import MAX_PANELS, RESOLVED_ROWS, first_edges, resolved_rows, rule_for
from solvers.rod.cycle.section import Field, RingingShape, field_of
from solvers.rod.cycle.state import ROWS, fill_states
from solvers.rod.piston.skirt import couple_of

_MAX_SLOPE_JUMPS, _OMITTED_FRACTION = 80.0, 1.0
"""Upper bound of the total slope jumps, per revolution, of a reaction's weight in the mean; fraction of the tolerance
up to which ringing may be omitted from the mean."""
_RADIANS_PER_PANEL, _POINTS, _MAX_FREQUENCY = 8.0, 16, 1500.0
"""Phase of the highest mode per panel [rad], points per panel, and the maximum frequency of modes taken into account
[1/rad]."""
_RADIANS_PER_POINT = 1.5
"""Maximum phase of an oscillation per point [rad] in an initial panel; at 2 rad the last coefficients may be small by
accident."""
NO_RINGING = RingingShape(no_ripple(1, radau(10)), np.zeros((1, 1)), np.zeros((1, 1)), np.zeros(1), np.zeros(1), 0)


@dataclass(frozen=True)
class SampledCycle:
    """A revolution on panels; ``side`` and ``moment`` hold T [N] and M0 [N m] with all corrections except ringing."""

    cycle: Cycle
    tolerance: float
    panels: Panels
    field: Field
    side: Array
    moment: Array
    ringing: RingingShape

    @staticmethod
    def of(cycle: Cycle, tolerance: float, accuracy: float, initial: Panels | None = None) -> SampledCycle:
        """Sample a cycle to ``tolerance`` relative to the maximum magnitudes, with the panel rule for an ``accuracy``
        of the results, starting from the panels of an earlier sampling if given."""
        strip, load = cycle.strip, cycle.scene.load
        sharp = np.ascontiguousarray(load.sharp_angles(), dtype=float)
        vibrates = any(refinement.ringing is not None for refinement in cycle.refinements)
        edges, rule = initial or (first_edges(cycle.drive, strip, sharp), rule_for(load, accuracy, vibrates))
        edges = split(edges, _max_width(cycle, rule))
        sampler = _Sampler(cycle, rule)
        panels, rows, _ = resolve(sampler, edges, rule, RESOLVED_ROWS, tolerance, MAX_PANELS)
        states, series = np.split(rows[RESOLVED_ROWS:], [ROWS])
        field = field_of(*panels, strip, states, *np.split(series, 2), sampler.inclined)
        return SampledCycle(cycle, tolerance, panels, field, rows[1], rows[2], sampler.ringing)

    def evaluate(self, diagram: Diagram, stations: int, contact: bool, power: bool, out: Array) -> tuple[float, float]:
        """Write the results for a fatigue diagram to ``out`` (FIELD_RESULTS,), the contact load only with ``contact``;
        return the friction power [W], nan without ``power``, and the maximum relative error."""
        guide, tolerance = self.guide(), self.tolerance
        error = field_results(self.field, self.ringing, guide, contact, *diagram, tolerance, stations, out)
        if not power:
            return np.nan, error
        found, missed = self.friction_power()
        return found, max(error, missed)

    def guide(self) -> Guide:
        """The guide with its loads except ringing."""
        return guide_of(self.cycle.scene, self.side, self.moment)

    def friction_power(self) -> tuple[float, float]:
        """Mean friction power [W] and its relative error."""
        guide, panels, left_out = self.guide(), self.panels, 0.0
        if self.ringing.ripple.modes:
            panels, guide, left_out = self._with_ripple(guide)
        power, error = friction_power(*panels, guide, self.tolerance)
        # The mean of |v| is two strokes per revolution.
        return power, error + (guide.per_wall * 4.0 / TURN * left_out / power if power else 0.0)

    def _with_ripple(self, guide: Guide) -> tuple[Panels, Guide, float]:
        """Return the guide including the ringing relevant to the mean power, on panels that resolve it, and the
        possible effect of the omitted ringing on the mean wall force [N]."""
        ringing, without_ringing = self.ringing, np.stack([self.side, self.moment])
        ripple, weights = ringing.ripple, np.stack([ringing.side, ringing.moment])
        couple, couple_weights = (couple_of(t, m, guide.lever, guide.offset) for t, m in (without_ringing, weights))
        scale = float(np.abs(self.side).max() + np.abs(couple).max())
        reach = amplitude_bounds(ripple, weights[0]) + amplitude_bounds(ripple, couple_weights)
        reach, frequency = reach.max(axis=0) / scale, ripple.frequency.max(axis=0)
        # Ringing contributes to a mean by its restarts, by slope jumps of its weight, and quadratically.
        restarts, slope_jumps = 2.0 * ringing.begins / TURN, _MAX_SLOPE_JUMPS / TURN
        effect = reach * np.minimum(restarts / frequency + slope_jumps / frequency**2 + reach.sum(), 1.0)
        omitted = np.append(np.cumsum(effect[::-1])[::-1], 0.0)
        negligible = omitted <= _OMITTED_FRACTION * self.tolerance
        modes = int(np.flatnonzero(negligible | (np.append(frequency, np.inf) > _MAX_FREQUENCY))[0])
        if not modes:
            return self.panels, guide, float(omitted[0]) * scale
        panels = Panels(split(self.panels.edges, _RADIANS_PER_PANEL / frequency[:modes].max()), rule_of(_POINTS))
        angle = panels.angles_inside
        reactions = values_at(*self.panels, without_ringing, angle) + ripple_at(ripple, modes, weights, angle)
        tail = panel_errors(np.stack([self.side, couple]), self.panels.rule).sum(axis=0)
        tail_effect = float(tail @ np.diff(self.panels.edges)) / TURN
        guide = guide._replace(side=reactions[0], moment=reactions[1])
        return panels, guide, float(omitted[modes]) * scale + tail_effect


def _max_width(cycle: Cycle, rule: Rule) -> float:
    """Maximum width of panels whose last coefficients indicate whether the corrections' oscillations are resolved. With
    fewer points than two per period, oscillations are aliased to lower frequencies."""
    frequency = max(one.highest_frequency for one in cycle.refinements)
    return _RADIANS_PER_POINT * rule.points.size / frequency if frequency else np.inf


class _Sampler:
    """Rows of a cycle at given angles: the resolved quantities, the states, and the corrections' series."""

    def __init__(self, cycle: Cycle, rule: Rule) -> None:
        self._cycle, self._rule = cycle, rule
        self._corrections = [refinement.without_ringing for refinement in cycle.refinements]
        self.ringing = next((r.ringing for r in cycle.refinements if r.ringing is not None), NO_RINGING)
        self.terms = max((c.terms for c in self._corrections), default=0)
        self.inclined = any(c.inclines for c in self._corrections)

    def __call__(self, angle: Array) -> Array:
        if self.ringing is not NO_RINGING:
            # The part without ringing has jumps at corners.
            angle = inside(angle, self._rule)
        rows = np.zeros((RESOLVED_ROWS + ROWS + 2 * self.terms, angle.size))
        states = rows[RESOLVED_ROWS : RESOLVED_ROWS + ROWS]
        fill_states(self._cycle.drive, self._cycle.strip, angle, states)
        rows[:RESOLVED_ROWS] = resolved_rows(states)
        curvature_series, deflection_series = rows[RESOLVED_ROWS + ROWS :].reshape(2, self.terms, angle.size)
        for correction in self._corrections:
            side, moment = correction.add(states, curvature_series, deflection_series)
            rows[1] += side
            rows[2] += moment
        if self.terms:
            rows[3] += curvature_series.sum(axis=0)
            midspan = legendre_at(np.zeros(1), self.terms)[0, : self.terms]
            rows[4] += midspan @ curvature_series
        return rows
