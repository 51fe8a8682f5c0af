"""What a kind of design is to the service: its request and result models and the calls into ``solvers``.

The registry is the only list of kinds; routes, storage, forms, jobs and exports follow from it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from importlib.resources import files
from typing import Any

from pydantic import BaseModel

from app.designs.calculation.chain import Chain
from app.designs.drawing import Drawing
from app.designs.form import FormWords
from app.designs.part import Part
from app.designs.pictures.chart import Say
from app.designs.progress import Report, ignore_progress
from solvers.accuracy import Reference
from solvers.effects import Effect

Plot = Callable[[dict[str, Any], Say], str]
"""From a succeeded run, as its JSON tells it, to SVG, worded by a function from English."""


class Mode(StrEnum):
    DESIGN = "design"
    CHECK = "check"
    ANALYSIS = "analysis"
    ACCURACY = "accuracy"


class Detail(StrEnum):
    """How much of a result is wanted: all, or what is left without its curves and tables."""

    SCALARS = "scalars"
    FULL = "full"


REFUSED = "refused"
"""The status of an answer whose request cannot be accepted."""


@dataclass(frozen=True)
class Answer:
    """A solver's outcome at the edge: names and units of the HTTP contract, finite JSON values only.

    ``status`` is "succeeded", "infeasible" or "failed", or ``REFUSED`` where the request cannot be accepted;
    ``result`` is a dict in the shape of the job's result model; ``problem`` is a problem+json object where the solver
    refused or failed; ``verdict`` is whether the part holds, None of what is no part: an analysis, a study, a design
    that is not there.
    """

    status: str
    result: dict[str, Any] | None
    effects: list[dict[str, Any]]
    accuracy: dict[str, Any] | None
    timing: dict[str, float]
    problem: dict[str, Any] | None = None
    verdict: dict[str, Any] | None = None


def _nothing(_request: Any) -> float:
    return 0.0


def _no_figure(_mode: Mode, _result: Mapping[str, Any]) -> tuple[str, float | None]:
    return "", None


def _no_reference(_request: Any, _answer: Answer) -> None:
    return None


def _no_calculation(_run: Mapping[str, Any], _chain: Chain) -> None:
    return None


def _no_drawing(_request: dict[str, Any]) -> None:
    return None


def _no_part(_run: Mapping[str, Any]) -> bool:
    return False


@dataclass(frozen=True)
class Job:
    """One thing that can be asked of a kind: a request model, a result model, and the pure call between them.

    ``inline`` is true only where the call's time has a small proven bound, so that it may run on the event loop;
    everything else runs in a process that can be killed. ``extra_s`` is the time that a request itself may ask for on
    top of the budget. ``repeatable`` is false where time is part of the answer, so that no earlier one will do.
    ``reference`` solves a request by independent means, to judge accuracies by, where there are such means; it is given
    the job's own tightest answer, which tells the effects that ran and what was found.
    ``infeasible`` is the result where there is no answer, if the kind says more than the diagnosis all kinds have.
    ``in_steps`` is the call of a job that takes long, and tells how far it is.
    ``best_in_time`` is true where the call looks at the clock: it ends by itself at the request's ``time_budget_s``,
    with the best it has found. A call that does not is killed instead.
    ``run_many`` answers many requests in less time than one after the other, where there is such a way: one answer for
    each, the same as ``run`` gives, in their order; ``tables`` are the results that it leaves out unless all is wanted.
    """

    request: type[BaseModel]
    result: type[BaseModel]
    run: Callable[[Any], Answer]
    inline: bool = False
    extra_s: Callable[[Any], float] = _nothing
    repeatable: bool = True
    reference: Callable[[Any, Answer], Reference | None] = _no_reference
    infeasible: type[BaseModel] | None = None
    in_steps: Callable[[Any, Report], Answer] | None = None
    best_in_time: bool = False
    run_many: Callable[[Sequence[Any], Detail], list[Answer]] | None = None
    tables: tuple[str, ...] = ()

    def solve(self, request: Any, report: Report = ignore_progress) -> Answer:
        """The answer, told of on the way where the job is a long one."""
        return self.run(request) if self.in_steps is None else self.in_steps(request, report)

    def rehearse(self, request: Any) -> None:
        """Have in memory what its calls need, for one request and for many."""
        self.run(request)
        if self.run_many is not None:
            self.run_many([request], Detail.SCALARS)


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of design: its slug in URLs, its title for people, its jobs by mode, the effects that its scenes can
    call for, its plots by name.

    ``main_results`` are the numbers of a result that an accuracy study judges, a dotted name for one within a group;
    none where the answer has a closed form. ``given_results`` join them where the dimensions are given: a design whose
    objective is flat in them leaves them uncertain by the square root of its own error.
    ``figure`` is the number of a result that matters most, with its name and unit as a field would be named.
    ``drawn_if`` names the plots that only some runs have, and how to tell from the run.
    ``form`` words the kind's forms; ``drawing`` is the part with its dimensions, from a request as JSON tells it, which
    may still lack much: None where nothing can be drawn yet. ``part`` is what can be made, from a run with a result
    that ``has_part``, at an angle of its crank in degrees where it has one. ``denials`` has what a verdict says of a
    criterion, by its name, where a yes is a no. ``calculation`` fills a chain with how a person checks a succeeded run
    by hand; it raises NotANumber where that cannot go on. ``followed`` names the effects that it has in it.
    """

    slug: str
    title: str
    summary: str
    jobs: Mapping[Mode, Job]
    known_effects: Sequence[Effect]
    plots: Mapping[str, Plot]
    main_results: tuple[str, ...]
    given_results: tuple[str, ...] = ()
    drawn_if: Mapping[str, Callable[[dict[str, Any]], bool]] = field(default_factory=dict)
    figure: Callable[[Mode, Mapping[str, Any]], tuple[str, float | None]] = _no_figure
    form: FormWords = field(default_factory=FormWords)
    drawing: Callable[[dict[str, Any]], Drawing | None] = _no_drawing
    calculation: Callable[[Mapping[str, Any], Chain], None] = _no_calculation
    followed: frozenset[str] = frozenset()
    part: Callable[[Mapping[str, Any], float | None], Part] | None = None
    has_part: Callable[[Mapping[str, Any]], bool] = _no_part
    denials: Mapping[str, str] = field(default_factory=dict)

    def judged(self, mode: Mode) -> tuple[str, ...]:
        """The names of the results by which an answer in that mode is judged."""
        return self.main_results if mode is Mode.DESIGN else (*self.main_results, *self.given_results)

    def judged_values(self, result: Mapping[str, Any], mode: Mode) -> dict[str, float | None]:
        """Those results, None where one does not exist; without those that the result has no place for."""
        found = {}
        for name in self.judged(mode):
            group, _, inner = name.rpartition(".")
            holder = result.get(group, {}) if group else result
            if holder is None or inner in holder:
                found[name] = None if holder is None else holder[inner]
        return found

    def effects(self) -> list[dict[str, Any]]:
        """The effects as the service shows them."""
        return [{"name": e.name, "summary": e.summary, "measure": e.measure} for e in self.known_effects]

    def example(self, mode: Mode) -> dict[str, Any]:
        """A worked example of a request of that mode."""
        return json.loads((files("app.designs") / "examples" / f"{self.slug}-{mode}.json").read_text("utf-8"))

    def others(self, mode: Mode) -> dict[str, dict[str, Any]]:
        """More worked examples of that mode by their titles; each says in what it differs from the first."""
        told = json.loads((files("app.designs") / "examples" / "others.json").read_text("utf-8"))
        first = self.example(mode)
        found = told.get(f"{self.slug}-{mode}", {})
        # A request of another method shares no field with the first.
        return {title: own if "method" in own else {**first, **own} for title, own in found.items()}
