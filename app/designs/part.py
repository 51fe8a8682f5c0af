"""A part as its drawings, solids and tables of parameters all see it, in mm: made from a stored result alone."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.designs.drawing import Circle, Drawing, Outline, Place


@dataclass(frozen=True)
class Extrusion:
    """A flat outline with round holes, ``height`` thick from ``bottom`` up, along z.

    ``turn_deg`` and ``shift`` place it among others: turned about the origin, then moved.
    """

    name: str
    outline: Outline
    holes: tuple[Circle, ...]
    bottom: float
    height: float
    turn_deg: float = 0.0
    shift: Place = (0.0, 0.0)


@dataclass(frozen=True)
class Revolution:
    """A profile of (place along the axis, radius) turned about the axis of x."""

    name: str
    profile: Outline


Solid = Extrusion | Revolution


@dataclass(frozen=True)
class Parameter:
    """A number that describes the part, by a name that every CAD program takes; ``unit`` is mm, deg or nothing."""

    name: str
    value: float
    unit: str
    comment: str


@dataclass(frozen=True)
class Part:
    """A part: its solids, its parameters, its drawing, and what there is to say of it in the title block.

    ``density_kg_m3`` is known of a part whose result tells its mass, ``mass_g``.
    """

    title: str
    solids: tuple[Solid, ...]
    parameters: tuple[Parameter, ...]
    drawing: Drawing
    mass_g: float | None = None
    density_kg_m3: float | None = None
    remarks: tuple[str, ...] = field(default=())


class UnfitAngle(ValueError):
    """A part cannot stand at the angle asked for; ``allowed`` says at which it can."""

    def __init__(self, reason: str, allowed: str) -> None:
        super().__init__(reason)
        self.allowed = allowed
