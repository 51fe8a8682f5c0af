"""The only list of kinds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.designs.accuracy import study_job
from app.designs.effect_bars import effect_bars
from app.designs.flexible_rod import FLEXIBLE_ROD
from app.designs.impact_linkage import IMPACT_LINKAGE
from app.designs.kind import Job, Kind, Mode, Plot
from app.designs.work_precision import work_precision

KINDS: dict[str, Kind] = {kind.slug: kind for kind in (FLEXIBLE_ROD, IMPACT_LINKAGE)}


def job_of(kind: Kind, mode: Mode) -> Job:
    """What a mode of a kind does: one of the kind's own jobs, or the accuracy study that every kind has."""
    return study_job(kind) if mode is Mode.ACCURACY else kind.jobs[mode]


def example_of(kind: Kind, mode: Mode) -> dict[str, object]:
    """A request of that mode: the kind's own example, or the study of its check."""
    return {"spec": kind.example(Mode.CHECK), "study_budget_s": 2.0} if mode is Mode.ACCURACY else kind.example(mode)


def modes_of(kind: Kind) -> tuple[Mode, ...]:
    """Everything that can be asked of a kind over HTTP."""
    return (*kind.jobs, Mode.ACCURACY) if Mode.CHECK in kind.jobs or Mode.DESIGN in kind.jobs else tuple(kind.jobs)


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
