"""What a worker does for the service: find the kind's job, validate the request again, run it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING

from app.designs.kind import Answer, Mode
from app.designs.progress import Report
from app.jobs import marks

if TYPE_CHECKING:
    from app.exports.export import File, Refusal

_loaded: set[tuple[str, str]] = set()
"""What this process, or the one it was forked from, has the kernels of in memory."""


PICTURE = "picture:"
"""Before the name of a plot, in the place of a mode: draw it from a run and a language, given as JSON."""

EXPORT = "export:"
"""Before the name of an export: make its file from a run and the wishes beside it, given as JSON."""


def answer(kind_slug: str, mode: str, payload: bytes, report: Report) -> Answer | str | File | Refusal:
    """Run one job of the registry on a request given as JSON; a long one reports how far it is. Or draw a plot, or make
    a file."""
    from app.designs.registry import KINDS, job_of

    if mode.startswith(EXPORT):
        return _file(kind_slug, mode.removeprefix(EXPORT), payload)
    if mode.startswith(PICTURE):
        return _picture(kind_slug, mode.removeprefix(PICTURE), payload)
    job = job_of(KINDS[kind_slug], Mode(mode))
    return job.solve(job.request.model_validate_json(payload), report)


def _picture(kind_slug: str, name: str, payload: bytes) -> str:
    from app.designs.registry import KINDS, plots_of
    from app.words.languages import gettext, speaking

    asked = json.loads(payload)
    with speaking(asked["language"]):
        return plots_of(KINDS[kind_slug], Mode(asked["run"]["mode"]))[name](asked["run"], gettext)


def _file(kind_slug: str, name: str, payload: bytes) -> File | Refusal:
    from app.designs.registry import KINDS
    from app.exports.export import Wishes
    from app.exports.registry import EXPORTS

    asked = json.loads(payload)
    wishes = Wishes(**asked["wishes"])
    return EXPORTS[name].file(KINDS[kind_slug], asked["run"], wishes)


def load(kind_slug: str, mode: str) -> None:
    """Have the kernels of one kind and mode in memory, by solving its example loosely."""
    from app.designs.rehearsals import example

    if mode.startswith((PICTURE, EXPORT)) or (kind_slug, mode) in _loaded:
        return
    _loaded.add((kind_slug, mode))
    found = example(kind_slug, mode)
    if found is not None:
        job, request = found
        job.rehearse(request)


def load_nothing(_kind_slug: str, _mode: str) -> None:
    """Of a worker whose calls need no kernels."""


def nothing() -> Iterator[None]:
    """Idle work of a worker that is there for a single call."""
    return iter(())


def load_step_by_step() -> Iterator[None]:
    """Load the kernels of every kind and mode that are on disk, one after the other."""
    from app.designs.rehearsals import PARTS

    for part in PARTS:
        if marks.is_left(part):
            load(*part)
            yield
