"""The interface of a kind of design: request and result models and calls into ``solvers``.

Routes, storage, forms, jobs and exports are derived from the registry.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from importlib.resources import files
from typing import Any, NamedTuple

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
"""From a succeeded run as JSON object to an SVG, translated by the second argument."""


class Mode(StrEnum):
    DESIGN = "design"
    CHECK = "check"
    ANALYSIS = "analysis"
    ACCURACY = "accuracy"


class Detail(StrEnum):
    """Amount of detail in a result: full, or without curves and tables."""

    SCALARS = "scalars"
    FULL = "full"


REFUSED = "refused"
"""Status of an answer to an invalid request."""


class Answer(NamedTuple):
    """A solver's outcome in the names and units of the API; finite JSON values only.

    ``status`` is "succeeded", "infeasible", "failed" or ``REFUSED``. ``result`` has the shape of the job's result
    model. ``problem`` is a problem+json object if the solver refused or failed. ``verdict`` says whether the part
    holds; None for analyses, studies and designs without a result.
    """

    status: str
    result: dict[str, Any] | None
    effects: list[dict[str, Any]]
    accuracy: dict[str, Any] | None
    timing: dict[str, float]
    problem: dict[str, Any] | None = None
    verdict: dict[str, Any] | None = None


@dataclass(frozen=True)
class Job:
    """A job of a kind: request model, result model, and the pure function between them.

    extra_s     time that a request may claim on top of the budget
    repeatable  false if time is part of the answer, so that cached answers are not valid
    reference   solves a request by independent means, for accuracy studies; given the job's tightest answer with its
        effects
    infeasible  result model for no solution, if it says more than the common diagnosis
    in_steps    ``run`` also takes a report of its progress, for long jobs
    best_in_time  the call watches the clock and ends at ``time_budget_s`` with the best solution; others are killed
    run_many    bulk evaluation with the same answers as ``run``, in order, each made when it is taken; omits
        ``tables`` unless full detail is requested
    """

    request: type[BaseModel]
    result: type[BaseModel]
    run: Callable[..., Answer]
    extra_s: Callable[[Any], float] = lambda _request: 0.0
    repeatable: bool = True
    reference: Callable[[Any, Answer], Reference | None] = lambda _request, _answer: None
    infeasible: type[BaseModel] | None = None
    in_steps: bool = False
    best_in_time: bool = False
    run_many: Callable[[Sequence[Any], Detail], Iterable[Answer]] | None = None
    tables: tuple[str, ...] = ()

    def solve(self, request: Any, report: Report = ignore_progress) -> Answer:
        """Solve, with progress reports if the job supports them."""
        return self.run(request, report) if self.in_steps else self.run(request)

    def rehearse(self, request: Any) -> None:
        """Load everything its calls need, for single and bulk evaluation."""
        self.run(request)
        if self.run_many is not None:
            for _ in self.run_many([request], Detail.SCALARS):
                pass


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of design.

    slug, title   in URLs, and for display
    titles        titles of requests in which a field, given by its name, has a value
    jobs, plots   by mode, and by name
    main_results  numbers judged by an accuracy study, dotted for nested ones; none for closed-form answers
    given_results  judged as well if the dimensions are given; a flat objective leaves a design's own dimensions
        uncertain by the square root of its error
    figure        the headline number of a result: name with unit suffix, and value
    whole         the part of a result, if any, whose figures of the whole machine precede those of one cylinder
    drawn_if      conditions of plots that only some runs have
    form          wording of the forms
    drawing       dimensioned drawing from a possibly incomplete request; None if nothing can be drawn yet
    part          the part of a run for which ``has_part`` holds, at a crank angle [deg] if it has one
    part_if       whether a result describes a part
    labels        labels of the verdict's criteria, by name
    denials       wording of failed yes/no criteria, by name
    calculation   fills a chain with the hand calculation of a succeeded run; raises NotANumber if that is impossible
    followed      effects covered by the hand calculation
    """

    slug: str
    title: str
    summary: str
    jobs: Mapping[Mode, Job]
    known_effects: Sequence[Effect]
    plots: Mapping[str, Plot]
    main_results: tuple[str, ...]
    figure: Callable[[Mode, Mapping[str, Any]], tuple[str, float | None]]
    drawing: Callable[[dict[str, Any]], Drawing | None]
    calculation: Callable[[Mapping[str, Any], Chain], None]
    titles: Mapping[tuple[str, str], str] = field(default_factory=dict)
    given_results: tuple[str, ...] = ()
    whole: str = ""
    drawn_if: Mapping[str, Callable[[dict[str, Any]], bool]] = field(default_factory=dict)
    form: FormWords = field(default_factory=FormWords)
    followed: frozenset[str] = frozenset()
    part: Callable[[Mapping[str, Any], float | None], Part] | None = None
    part_if: Callable[[Mapping[str, Any]], bool] = lambda _result: False
    labels: Mapping[str, str] = field(default_factory=dict)
    denials: Mapping[str, str] = field(default_factory=dict)

    def title_of(self, spec: Mapping[str, Any]) -> str:
        """The title of what a request, which may be incomplete or that of an accuracy study, is about."""
        spec = spec.get("spec", spec)
        return next((title for (name, value), title in self.titles.items() if spec.get(name) == value), self.title)

    def has_part(self, run: Mapping[str, Any]) -> bool:
        """Whether a run with a result describes a part."""
        return run["status"] == "succeeded" and run["mode"] != Mode.ACCURACY and self.part_if(run["result"])

    def judged(self, mode: Mode) -> tuple[str, ...]:
        """Names of the results judged in a mode."""
        return self.main_results if mode is Mode.DESIGN else (*self.main_results, *self.given_results)

    def judged_values(self, result: Mapping[str, Any], mode: Mode) -> dict[str, float | None]:
        """Values of the judged results, None if undefined; without those that the result model lacks."""
        found = {}
        for name in self.judged(mode):
            group, _, inner = name.rpartition(".")
            holder = result.get(group, {}) if group else result
            if holder is None or inner in holder:
                found[name] = None if holder is None else holder[inner]
        return found

    def headline(self, mode: Mode, result: Mapping[str, Any]) -> tuple[str, float | None]:
        """The headline number of a result by name and value; of an accuracy study its recommendation."""
        if mode is Mode.ACCURACY:
            return "recommended_accuracy", (result["recommended"] or {}).get("accuracy")
        return self.figure(mode, result)

    def effects(self) -> list[dict[str, Any]]:
        """The kind's effects as JSON."""
        return [{"name": e.name, "summary": e.summary, "measure": e.measure} for e in self.known_effects]

    def example(self, mode: Mode) -> dict[str, Any]:
        """The example request of a mode."""
        return json.loads((files("app.designs") / "examples" / f"{self.slug}-{mode}.json").read_text("utf-8"))

    def others(self, mode: Mode) -> dict[str, dict[str, Any]]:
        """Further examples of a mode by title, as changes of the first one."""
        examples = json.loads((files("app.designs") / "examples" / "others.json").read_text("utf-8"))
        first = self.example(mode)
        found = examples.get(f"{self.slug}-{mode}", {})
        # Requests of different methods share no fields.
        return {title: own if "method" in own else {**first, **own} for title, own in found.items()}
