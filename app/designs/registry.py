"""The only list of kinds. A kind is imported when it is asked for: a check of a pin needs nothing of a rod."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import Any

from app.designs.accuracy import study_job
from app.designs.kind import Job, Kind, Mode, Plot
from app.designs.pictures.effect_bars import effect_bars
from app.designs.pictures.work_precision import work_precision

_SLUGS = ("flexible-rod", "pin-profile", "impact-linkage", "crank-dynamics", "crank-masses")
"""Each names its package and the object of its module ``kind``."""


class _Kinds(Mapping[str, Kind]):
    def __getitem__(self, slug: str) -> Kind:
        if slug not in _SLUGS:
            raise KeyError(slug)
        return _kind(slug)

    def __contains__(self, slug: object) -> bool:
        return slug in _SLUGS

    def __iter__(self) -> Iterator[str]:
        return iter(_SLUGS)

    def __len__(self) -> int:
        return len(_SLUGS)


@cache
def _kind(slug: str) -> Kind:
    name = slug.replace("-", "_")
    found = getattr(import_module(f"app.designs.{name}.kind"), name.upper())
    assert isinstance(found, Kind) and found.slug == slug
    return found


KINDS: Mapping[str, Kind] = _Kinds()


def job_of(kind: Kind, mode: Mode) -> Job:
    """What a mode of a kind does: one of its own jobs, or the accuracy study where accuracy is a choice."""
    return study_job(kind) if mode is Mode.ACCURACY else kind.jobs[mode]


def example_of(kind: Kind, mode: Mode) -> dict[str, object]:
    """A request of that mode: the kind's own example, or the study of its quickest job."""
    if mode is not Mode.ACCURACY:
        return kind.example(mode)
    quickest = next(m for m in (Mode.CHECK, Mode.ANALYSIS, Mode.DESIGN) if m in kind.jobs)
    return {"spec": kind.example(quickest), "study_budget_s": 2.0}


def modes_of(kind: Kind) -> tuple[Mode, ...]:
    """Everything that can be asked of a kind over HTTP."""
    return (*kind.jobs, Mode.ACCURACY) if kind.main_results else tuple(kind.jobs)


def plots_of(kind: Kind, mode: Mode) -> Mapping[str, Plot]:
    """The pictures that runs of that mode can have."""
    own = {"error-against-time": work_precision} if mode is Mode.ACCURACY else kind.plots
    return {**own, "effects": effect_bars} if kind.effects() else own


def plots_for(kind: Kind, run: Mapping[str, Any]) -> Mapping[str, Plot]:
    """The pictures of a succeeded run, as its JSON tells it."""
    found = plots_of(kind, Mode(run["mode"]))
    return {name: plot for name, plot in found.items() if kind.drawn_if.get(name, _always)(run)}


def _always(_run: Mapping[str, Any]) -> bool:
    return True
