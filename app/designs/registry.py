"""Registry of kinds. A kind is imported on first access, so that a pin's check imports nothing of the rod."""

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
"""Slugs; each names its package and the object in its module ``kind``."""


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
    """The job of a mode: the kind's own, or the accuracy study."""
    return study_job(kind) if mode is Mode.ACCURACY else kind.jobs[mode]


def example_of(kind: Kind, mode: Mode) -> dict[str, object]:
    """An example request of a mode; for the accuracy study, of the kind's fastest job."""
    if mode is not Mode.ACCURACY:
        return kind.example(mode)
    quickest = next(m for m in (Mode.CHECK, Mode.ANALYSIS, Mode.DESIGN) if m in kind.jobs)
    return {"spec": kind.example(quickest), "study_budget_s": 2.0}


def modes_of(kind: Kind) -> tuple[Mode, ...]:
    """All modes of a kind over HTTP."""
    return (*kind.jobs, Mode.ACCURACY) if kind.main_results else tuple(kind.jobs)


def plots_of(kind: Kind, mode: Mode) -> Mapping[str, Plot]:
    """The plots that runs of a mode may have."""
    own = {"error-against-time": work_precision} if mode is Mode.ACCURACY else kind.plots
    return {**own, "effects": effect_bars} if kind.known_effects else own


def plots_for(kind: Kind, run: Mapping[str, Any]) -> Mapping[str, Plot]:
    """The plots of a succeeded run given as JSON object."""
    found, conditions = plots_of(kind, Mode(run["mode"])), kind.drawn_if
    return {name: plot for name, plot in found.items() if name not in conditions or conditions[name](run)}
