"""The part of a run, as the formats that draw or model it need it."""

from __future__ import annotations

from app.designs.kind import Kind
from app.designs.part import Part, UnfitAngle
from app.exports.export import Refusal, Run, Wishes


def part_of(kind: Kind, run: Run, wishes: Wishes) -> Part | Refusal:
    """The part, or why it cannot stand as asked."""
    assert kind.part is not None
    try:
        return kind.part(run, wishes.angle_deg)
    except UnfitAngle as unfit:
        return Refusal("/angle_deg", str(unfit), unfit.allowed)
