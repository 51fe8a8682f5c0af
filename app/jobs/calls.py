"""Entry points of a worker: validate a request again and run its job, draw a plot, or make an export."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

from app.designs.kind import Mode
from app.designs.progress import Report
from app.jobs import warm_markers

if TYPE_CHECKING:
    from app.encoded_answer import EncodedAnswer
    from app.exports.export import File, Refusal

_loaded: set[tuple[str, str]] = set()
"""Kinds and modes whose kernels this process has in memory, by itself or from the process it was forked from."""


PICTURE = "picture:"
"""Prefix of a plot's name in the place of a mode: draw it from a run and a language given as JSON."""

EXPORT = "export:"
"""Prefix of an export's name in the place of a mode: make its file from a run and options given as JSON."""


def answer(kind_slug: str, mode: str, payload: bytes, report: Report) -> EncodedAnswer | str | File | Refusal:
    """Run a registered job on a request given as JSON and report its progress; or draw a plot; or make an export."""
    if mode.startswith(EXPORT):
        return _file(kind_slug, mode.removeprefix(EXPORT), payload)
    if mode.startswith(PICTURE):
        return _picture(kind_slug, mode.removeprefix(PICTURE), payload)
    return _solver(kind_slug, mode)(payload, report)


@cache
def _solver(kind_slug: str, mode: str) -> Callable[[bytes, Report], EncodedAnswer]:
    """Runs a registered job on a request given as JSON, and reports its progress."""
    from app.designs.registry import KINDS, job_of
    from app.designs.rehearsals import mode_of
    from app.encoded_answer import EncodedAnswer

    job = job_of(KINDS[kind_slug], mode_of(mode))

    def solved(payload: bytes, report: Report) -> EncodedAnswer:
        return EncodedAnswer.of(kind_slug, mode_of(mode), job.solve(job.request.model_validate_json(payload), report))

    return solved


def _picture(kind_slug: str, name: str, payload: bytes) -> str:
    from app.designs.registry import KINDS, plots_of
    from app.words.languages import gettext, speaking
    from app.words.units import System, measuring

    asked = json.loads(payload)
    with speaking(asked["language"]), measuring(System(asked["units"])):
        return plots_of(KINDS[kind_slug], Mode(asked["run"]["mode"]))[name](asked["run"], gettext)


def _file(kind_slug: str, name: str, payload: bytes) -> File | Refusal:
    from app.designs.registry import KINDS
    from app.exports.export import ExportOptions
    from app.exports.registry import EXPORTS

    asked = json.loads(payload)
    options = ExportOptions(**asked["options"])
    return EXPORTS[name].file(KINDS[kind_slug], asked["run"], options)


def load(kind_slug: str, mode: str) -> None:
    """Load the kernels of one kind and mode by solving its example at low accuracy."""
    from app.designs.rehearsals import example

    if mode.startswith((PICTURE, EXPORT)) or (kind_slug, mode) in _loaded:
        return
    _loaded.add((kind_slug, mode))
    found = example(kind_slug, mode)
    if found is not None:
        job, request = found
        job.rehearse(request)


def no_load(_kind_slug: str, _mode: str) -> None:
    """Load function of workers whose calls need no kernels."""


def load_step_by_step() -> Iterator[None]:
    """Load the compiled kernels of every kind and mode, a rehearsal per step, then the libraries of exports.

    Importing one takes a second: as part of a call, it would exceed the time of a short job, whose worker is then
    replaced by one without it.
    """
    from app.designs.rehearsals import PARTS, rehearsals_of
    from app.exports.registry import worker_libraries

    for part in PARTS:
        if warm_markers.exists(part):
            for job, request in rehearsals_of(*part):
                job.rehearse(request)
                yield
            _loaded.add(part)
    for library in worker_libraries():
        import_module(library)
        yield
