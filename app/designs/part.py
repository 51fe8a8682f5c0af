"""A part in mm, as used by drawings, solids and parameter tables; made from a stored result alone."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.designs.drawing import Circle, Drawing, Outline, Place


@dataclass(frozen=True)
class Extrusion:
    """A planar outline with round holes, extruded by ``height`` from ``bottom`` along z.

    ``turn_deg`` rotates it about the origin, then ``shift`` moves it.
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
    """A profile of (axial position, radius) revolved about the x axis."""

    name: str
    profile: Outline


Solid = Extrusion | Revolution


@dataclass(frozen=True)
class Parameter:
    """A parameter of the part, with a name valid in every CAD program; ``unit`` is mm, deg or empty."""

    name: str
    value: float
    unit: str
    comment: str


@dataclass(frozen=True)
class Part:
    """A part: solids, parameters, drawing, and remarks for the title block.

    ``mass_g`` and ``density_kg_m3`` are given if the result has a mass.
    """

    title: str
    solids: tuple[Solid, ...]
    parameters: tuple[Parameter, ...]
    drawing: Drawing
    mass_g: float | None = None
    density_kg_m3: float | None = None
    remarks: tuple[str, ...] = field(default=())


class UnfitAngle(ValueError):
    """The part cannot take the requested angle; ``allowed`` says which angles it can."""

    def __init__(self, reason: str, allowed: str) -> None:
        super().__init__(reason)
        self.allowed = allowed
