"""What an export is: a name, a form, and how its file is made from a run."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from app.designs.kind import Kind

Run = dict[str, Any]
"""A run as its JSON tells it."""


class Tool(StrEnum):
    """CAD programs that parameters are written for."""

    FREECAD = "freecad"
    FUSION = "fusion"
    ONSHAPE = "onshape"
    SOLIDWORKS = "solidworks"
    INVENTOR = "inventor"


class Where(StrEnum):
    """The process in which a file is made."""

    HERE = "here"
    """In the service's own: what takes no longer than reading the run."""
    WORKER = "worker"
    """In one that solves."""
    SOLIDS = "solids"
    """In the one that has the solid modeller in memory."""


@dataclass(frozen=True)
class Wishes:
    """What a request may ask of its file beside the format; each format takes what concerns it.

    tool       the CAD program that parameters are for
    angle_deg  the crank's angle after the blow in which a linkage stands; None: at the blow
    language   of a report
    """

    tool: Tool = Tool.FREECAD
    angle_deg: float | None = None
    language: str = "en"


@dataclass(frozen=True)
class File:
    """A file, where its form depends on the wishes."""

    content: bytes
    media_type: str
    extension: str


@dataclass(frozen=True)
class Refusal:
    """Why there is no file as wished: the parameter at fault, what is wrong with it, and what is allowed."""

    pointer: str
    detail: str
    allowed: str


Make = Callable[[Kind, Run, Wishes], bytes | File | Refusal]
"""From a run with a result to its file. It may import what it needs: it is called where that does no harm."""


def of_every_run(_kind: Kind, _run: Run) -> bool:
    return True


def of_a_part(kind: Kind, run: Run) -> bool:
    """Whether the run tells of a part that can be drawn and made."""
    return kind.has_part(run)


@dataclass(frozen=True)
class Export:
    """One format. ``applies`` sees a run that has a result, at least its kind, mode, status and result.

    ``module`` is what has to be importable, ``extra`` what installs it; wishes may lead to ``other_media_types``.
    """

    name: str
    title: str
    media_type: str
    extension: str
    make: Make
    applies: Callable[[Kind, Run], bool] = of_every_run
    where: Where = Where.WORKER
    module: str = ""
    extra: str = ""
    other_media_types: tuple[str, ...] = ()

    @property
    def media_types(self) -> set[str]:
        """All that its files may have, without parameters."""
        return {form.partition(";")[0] for form in (self.media_type, *self.other_media_types)}

    @property
    def missing(self) -> bool:
        """Whether this installation cannot make it."""
        return bool(self.module) and importlib.util.find_spec(self.module) is None

    def file(self, kind: Kind, run: Run, wishes: Wishes) -> File | Refusal:
        """The run's file in this format, or why there is none as wished."""
        made = self.make(kind, run, wishes)
        return File(made, self.media_type, self.extension) if isinstance(made, bytes) else made
