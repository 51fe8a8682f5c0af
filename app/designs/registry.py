"""The only list of kinds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.designs.accuracy import study_job
from app.designs.crank_dynamics.kind import CRANK_DYNAMICS
from app.designs.crank_masses.kind import CRANK_MASSES
from app.designs.flexible_rod.kind import FLEXIBLE_ROD
from app.designs.impact_linkage.kind import IMPACT_LINKAGE
from app.designs.kind import Job, Kind, Mode, Plot
from app.designs.pictures.effect_bars import effect_bars
from app.designs.pictures.work_precision import work_precision
from app.designs.pin_profile.kind import PIN_PROFILE

KINDS: dict[str, Kind] = {
    kind.slug: kind for kind in (FLEXIBLE_ROD, PIN_PROFILE, IMPACT_LINKAGE, CRANK_DYNAMICS, CRANK_MASSES)
}


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
