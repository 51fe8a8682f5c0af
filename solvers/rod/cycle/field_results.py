"""Results of a sampled revolution, without and with corrections: those along the strip, then those of the guide."""

from __future__ import annotations

from solvers.numerics.arrays import Array
from solvers.numerics.jit import kernel
from solvers.rod.cycle.guide_loads import GUIDE_RESULTS, Guide, guide_results
from solvers.rod.cycle.peaks_along_strip import STRIP_RESULTS, strip_results
from solvers.rod.cycle.section import Field, RingingShape

FIELD_RESULTS = STRIP_RESULTS + GUIDE_RESULTS


@kernel
def field_results(
    field: Field, ringing: RingingShape | None, guide: Guide, contact: bool, lines: Array, parabola: Array,
    tolerance: float, stations: int, out: Array,
) -> float:  # fmt: skip
    """Write the results for a fatigue diagram to ``out`` (FIELD_RESULTS,), the contact load only with ``contact``;
    return the maximum relative error."""
    error = strip_results(field, ringing, lines, parabola, tolerance, stations, out[:STRIP_RESULTS])
    guide_out = out[STRIP_RESULTS:]
    return max(error, guide_results(field.edges, field.rule, guide, ringing, contact, tolerance, guide_out))
