"""The definition of an export: name, format, and how its file is made from a run."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from app.designs.kind import Kind
from app.designs.part import UnfitAngle

Run = dict[str, Any]
"""A run as its JSON object."""


class Tool(StrEnum):
    """CAD programs for which parameters can be written."""

    FREECAD = "freecad"
    FUSION = "fusion"
    ONSHAPE = "onshape"
    SOLIDWORKS = "solidworks"
    INVENTOR = "inventor"


class ExportProcess(StrEnum):
    """The process in which a file is made."""

    SERVICE = "service"
    """the service itself, for formats that take no longer than reading the run"""
    WORKER = "worker"
    """a solver worker"""
    SOLIDS = "solids"
    """the process with the solid modeller in memory"""


@dataclass(frozen=True)
class ExportOptions:
    """Options of an export; each format uses those that concern it.

    tool       CAD program of the parameters
    angle_deg  crank angle after the blow at which a linkage is drawn; None: at the blow
    language   of a report
    """

    tool: Tool = Tool.FREECAD
    angle_deg: float | None = None
    language: str = "en"


@dataclass(frozen=True)
class File:
    """An exported file."""

    content: bytes
    media_type: str
    extension: str


@dataclass(frozen=True)
class Refusal:
    """Why the file cannot be made with these options: the parameter, the error, and what is allowed."""

    pointer: str
    detail: str
    allowed: str


Make = Callable[[Kind, Run, ExportOptions], bytes | File | Refusal]
"""Makes the file of a run with a result. It may import heavy libraries, since it runs in the process chosen by
``ExportProcess``."""


def always(_kind: Kind, _run: Run) -> bool:
    return True


def has_part(kind: Kind, run: Run) -> bool:
    """Whether the run describes a part."""
    return kind.has_part(run)


@dataclass(frozen=True)
class Export:
    """An export format.

    ``applies`` decides from a run with a result, at least its kind, mode, status and result, whether the format is
    offered. ``module`` must be importable; ``extra`` installs it. With some options the file has one of
    ``other_media_types``.
    """

    name: str
    title: str
    media_type: str
    extension: str
    make: Make
    applies: Callable[[Kind, Run], bool] = always
    where: ExportProcess = ExportProcess.WORKER
    module: str = ""
    extra: str = ""
    other_media_types: tuple[str, ...] = ()

    @property
    def media_types(self) -> set[str]:
        """The media types that its files may have, without parameters."""
        return {form.partition(";")[0] for form in (self.media_type, *self.other_media_types)}

    @property
    def missing(self) -> bool:
        """Whether a required module is not installed."""
        return bool(self.module) and importlib.util.find_spec(self.module) is None

    def file(self, kind: Kind, run: Run, options: ExportOptions) -> File | Refusal:
        """The run's file in this format, or a refusal, also where the part cannot take the requested position."""
        try:
            made = self.make(kind, run, options)
        except UnfitAngle as unfit:
            return Refusal("/angle_deg", str(unfit), unfit.allowed)
        return File(made, self.media_type, self.extension) if isinstance(made, bytes) else made
