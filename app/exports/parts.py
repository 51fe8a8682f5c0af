"""The part of a run for formats that draw or model it."""

from __future__ import annotations

from app.designs.kind import Kind
from app.designs.part import Part, UnfitAngle
from app.exports.export import ExportOptions, Refusal, Run


def part_of(kind: Kind, run: Run, options: ExportOptions) -> Part | Refusal:
    """The part, or a refusal if it cannot take the requested position."""
    assert kind.part is not None
    try:
        return kind.part(run, options.angle_deg)
    except UnfitAngle as unfit:
        return Refusal("/angle_deg", str(unfit), unfit.allowed)
