"""One-line captions of a run's figures."""

from __future__ import annotations

from collections.abc import Iterable

from app.words.languages import gettext

CAPTIONS = {
    "error-against-time": "Greatest error against computing time, of every setting",
    "effects": "Estimated influence of each effect, against the tolerance for what is left out",
    "stability-map": "The strip against its buckling boundary",
    "forces-over-angle": "Forces over the cycle",
    "stresses-over-angle": "Stress of both fibres over the cycle, at the section that governs",
    "stress-along-strip": "Range of the fibres' stress over the cycle, along the strip",
    "feasible-region": "Feasible region, and the design in it",
    "bore": "Cut along the axis, to scale",
    "forces": "Bending moment and shear force along the axis",
    "stress": "Equivalent stress along the axis, against the allowable",
    "ring": "Hoop stress of the ring in the middle",
    "load-family": "The same part for other loads",
    "mechanism": "The mechanism to scale, through one cycle",
    "transfer": "u31 over the crank angle, with the blow",
    "loads": "Crank torque and pin force over the cycle",
    "front": "Trade-off of the objective against another quantity",
    "pressure-over-angle": "Pressure over the crank angle",
    "indicator-diagram": "Indicator diagram: pressure over the volume",
    "torque-over-angle": "Torque on the crank over the cycle, and its mean",
    "crank-pin-polar": "Load on the crank pin, turning with the crank",
    "two-harmonic-effect": "Error of the textbooks' two-harmonic formulas",
}
OF_A_KIND = {
    ("flexible-rod", "forces-over-angle"): "Axial force in the strip and side force on the piston over the cycle"
}

PARTS = {
    "flexible-rod": "The free strip from its broad face and from its edge; dashed, the ends by which clamp and head "
    "hold it. mm, to scale.",
    "pin-profile": "The part as the files have it, cut along its axis. mm, to scale.",
    "impact-linkage": "The four links as they stand at the blow; dashed, the outline of what they sweep. Below, "
    "each by itself. mm, to scale.",
}
"""Captions of part drawings by kind."""
PART_TITLES = (
    "The strip, to scale",
    "The pin, cut along its axis, to scale",
    "The bushing, cut along its axis, to scale",
    "The four links, to scale",
    "clamp",
    "head",
    "base",
    "crank",
    "coupler",
    "rocker",
)
"""Labels inside these drawings."""


def captioned(kind: str, names: Iterable[str]) -> list[tuple[str, str]]:
    """Figure names with translated captions."""
    return [
        (name, gettext(OF_A_KIND.get((kind, name)) or CAPTIONS.get(name, name.replace("-", " ")))) for name in names
    ]
