"""Form pages per kind and mode, and the live endpoints; only the live updates need JavaScript."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse, RedirectResponse

from app.access.csrf import FIELD
from app.access.scopes import Scope
from app.api.bodies import parse
from app.designs.kind import Kind, Mode
from app.designs.registry import KINDS
from app.edge.disconnect import cancel_on_disconnect
from app.errors import PASSING, Problem, problem_of
from app.jobs.errors import Busy
from app.store.record import RunFilter, RunStatus
from app.submission import Service
from app.web.again import checked_as
from app.web.forms.faults import Faults, placed
from app.web.forms.groups import Group
from app.web.forms.nodes import Texts, applies
from app.web.forms.numbers import others
from app.web.forms.shown_in import as_shown
from app.web.forms.switching import in_language, in_units
from app.web.forms.tree import form_of
from app.web.forms.words import script_words
from app.web.languages import COOKIE, UNITS_COOKIE, if_allowed, keep
from app.web.rendering import add_filter, page, templates
from app.words.drawings import drawn
from app.words.languages import Language, speaking
from app.words.languages import gettext as _
from app.words.solver_texts import spoken
from app.words.units import System, measuring

router = APIRouter(include_in_schema=False)

MOST_FIELDS = 1000
_MAX_RUNS_OFFERED = 50
_KEY_FIGURES = 6

templates.env.globals["applies"] = applies
add_filter("other_units", others)
templates.env.globals["script_words"] = script_words


def _kind_and_mode(slug: str, mode: str) -> tuple[Kind, Mode]:
    if slug not in KINDS or mode not in {str(m) for m in KINDS[slug].jobs}:
        raise Problem(404, "No such page", "there is no such kind or mode")
    return KINDS[slug], Mode(mode)


@asynccontextmanager
async def _sent(request: Request) -> AsyncIterator[dict[str, str]]:
    """The submitted texts by input name, without the CSRF token, in the units and language of the form."""
    most = request.app.state.settings.max_body_bytes
    async with request.form(max_fields=MOST_FIELDS, max_part_size=most) as sent:
        texts = {name: str(value).replace("\r\n", "\n") for name, value in sent.items() if name != FIELD}
    with as_shown(texts):
        yield texts


def _example(form: Group, kind: Kind, mode: Mode, title: str = "") -> dict[str, str]:
    texts: dict[str, str] = {}
    form.take(kind.others(mode).get(title) or kind.example(mode), texts)
    return texts


def _as_json(spec: Mapping[str, Any]) -> str:
    return json.dumps(spec, indent=2, ensure_ascii=False)


async def _stored_runs(request: Request, form: Group) -> list[tuple[str, str]]:
    """Runs offered as load source, if the form has such an input."""
    if not any(name.endswith("run_id") for name in form.names()):
        return []
    service: Service = request.app.state.service
    wanted = RunFilter(kind="crank-dynamics", status=RunStatus.SUCCEEDED)
    found = await service.store.list_runs(wanted, None, _MAX_RUNS_OFFERED)
    return [(run.id, f"{run.name or run.id[:13]}, {run.created_at:%Y-%m-%d %H:%M}") for run in found.items]


async def _shown(
    request: Request,
    kind: Kind,
    mode: Mode,
    texts: Texts,
    faults: Faults | None = None,
    status: int = 200,
    notice: str = "",
) -> Response:
    service: Service = request.app.state.service
    form = form_of(kind, mode, service.solve_budget_s)
    spec = form.value(texts)
    svg, caption = drawn(kind, spec)
    return page(
        request, "form.html", status, kind=kind, mode=mode, form=form, texts=texts, faults=faults or Faults(), svg=svg,
        title=kind.title_of(spec), caption=caption, as_json=_as_json(spec), runs=await _stored_runs(request, form),
        others=list(kind.others(mode)), notice=notice,
        kept_by=if_allowed(f"/designs/{kind.slug}?mode={mode}", Scope.DESIGN),
    )  # fmt: skip


@router.get("/designs/{slug}")
async def show(request: Request, slug: str, mode: str | None = None) -> Response:
    """The form of a kind, filled with its example.

    ``?example=TITLE`` selects another example; ``?from=ID`` prefills from a stored run (from another mode: the common
    fields and the dimensions found); ``?load_run=ID&instant=NAME`` takes the load from a run.
    """
    kind, chosen = _kind_and_mode(slug, mode or (str(next(iter(KINDS[slug].jobs))) if slug in KINDS else ""))
    form, query = form_of(kind, chosen), request.query_params
    texts = _example(form, kind, chosen, query.get("example", ""))
    if "from" in query:
        texts = await _texts_of_run(request, kind, chosen, query["from"], texts)
    if "load_run" in query:
        taken = {"load": "run", "load.run.run_id": query["load_run"], "load.run.instant": query.get("instant", "")}
        texts |= {name: text for name, text in taken.items() if name in set(form.names())} | {"name": ""}
    return await _shown(request, kind, chosen, texts)


async def _texts_of_run(
    request: Request, kind: Kind, mode: Mode, run_id: str, example: dict[str, str]
) -> dict[str, str]:
    service: Service = request.app.state.service
    run = json.loads(await service.as_json(run_id))
    if run["kind"] != kind.slug or run["mode"] not in kind.jobs:
        raise Problem(409, "Another form", f"the run is of {run['kind']}, {run['mode']}")
    asked: dict[str, str] = {}
    if run["mode"] == mode:
        form_of(kind, mode).take(run["spec"], asked)
        return asked
    if mode is Mode.CHECK:
        form_of(kind, mode).take({**kind.example(mode), **run["spec"], **checked_as(run)}, asked)
        return asked
    form_of(kind, Mode(run["mode"])).take(run["spec"], asked)
    return _carried(kind, Mode(run["mode"]), mode, asked, example)


def _carried(kind: Kind, old: Mode, new: Mode, filled: Texts, example: dict[str, str]) -> dict[str, str]:
    """Transfer texts from one mode's form to another; inputs that the old form lacks get the example's."""
    known = set(form_of(kind, old).names())
    kept = {name: text for name, text in example.items() if name not in known}
    return kept | {name: text for name, text in filled.items() if name in known}


@router.post("/designs/{slug}")
async def submit(
    request: Request,
    slug: str,
    mode: str = "design",
    was: str | None = None,
    language: Language | None = None,
    units: System | None = None,
) -> Response:
    """Submit the run and redirect to its page, or show the form again with messages at the faulty fields.

    ``was`` is the previous mode when the user switches modes, ``language`` or ``units`` what is chosen; the form is
    then converted, not submitted.
    """
    kind, chosen = _kind_and_mode(slug, mode)
    async with _sent(request) as texts:
        form = form_of(kind, chosen)
        if language is not None:
            texts = in_language(form, texts, language)
            with speaking(language):
                shown = await _shown(request, kind, chosen, texts)
            keep(shown, COOKIE, language)
            return shown
        if units is not None:
            texts = in_units(form, texts, units)
            with measuring(units):
                shown = await _shown(request, kind, chosen, texts)
            keep(shown, UNITS_COOKIE, units)
            return shown
        if was is not None:
            old = _kind_and_mode(slug, was)[1]
            return await _shown(request, kind, chosen, _carried(kind, old, chosen, texts, _example(form, kind, chosen)))
        return await begun(request, kind, chosen, texts, form.value(texts))


async def begun(request: Request, kind: Kind, mode: Mode, texts: Texts, spec: Mapping[str, Any]) -> Response:
    """Submit the run of ``spec`` and redirect to its page, or show the form with ``texts`` and with messages at the
    faulty fields."""
    service: Service = request.app.state.service
    try:
        work = service.submit_within(kind, mode, _asked(kind, mode, spec), request.app.state.settings.form_patience_s)
        run_id = await cancel_on_disconnect(request.receive, work)
    except Problem as problem:
        faults = placed(form_of(kind, mode), texts, problem)
        return await _shown(request, kind, mode, texts, faults, 422)
    except PASSING as error:
        refused = problem_of(error)
        why = _("Not now: %(why)s") % {"why": spoken(refused.body["detail"])}
        shown = await _shown(request, kind, mode, texts, status=refused.status, notice=why)
        shown.headers.update(refused.headers)
        return shown
    return RedirectResponse(f"/runs/{run_id}", status_code=303)


def _asked(kind: Kind, mode: Mode, spec: Mapping[str, Any]) -> Any:
    return parse(kind.jobs[mode].request, json.dumps(spec).encode())


@router.post("/designs/{slug}/drawing")
async def draw(request: Request, slug: str, mode: str = "design") -> Response:
    """Live preview without solving: drawing, faults and request JSON."""
    kind, chosen = _kind_and_mode(slug, mode)
    async with _sent(request) as texts:
        form = form_of(kind, chosen)
        spec = form.value(texts)
        faults = Faults()
        try:
            _asked(kind, chosen, spec)
        except Problem as problem:
            faults = placed(form, texts, problem)
        svg, caption = drawn(kind, spec)
        return JSONResponse(
            {
                "title": spoken(kind.title_of(spec)),
                "svg": svg,
                "caption": caption,
                "json": _as_json(spec),
                "faults": faults.at,
                "others": faults.elsewhere,
            }
        )


@router.post("/designs/{slug}/answer")
async def answer(request: Request, slug: str, mode: str = "check") -> Response:
    """Live result of the form: solved, but not stored."""
    kind, chosen = _kind_and_mode(slug, mode)
    if chosen is Mode.DESIGN:
        raise Problem(409, "Nothing to answer", "a design is not sought while one types")
    async with _sent(request) as texts:
        form = form_of(kind, chosen)
        service: Service = request.app.state.service
        try:
            work = service.answer(kind, chosen, _asked(kind, chosen, form.value(texts)))
            run = await cancel_on_disconnect(request.receive, work)
        except Problem as problem:
            faults = placed(form, texts, problem)
            return JSONResponse({"faults": faults.at, "others": faults.elsewhere}, 422)
        except Busy as error:
            return JSONResponse({"busy": _(str(error))}, 503)
        result = json.loads(run.result) if run.result else {}
        told = {
            "kind": kind,
            "verdict": json.loads(run.verdict) if run.verdict else None,
            "accuracy": json.loads(run.accuracy) if run.accuracy else None,
            "problem": json.loads(run.problem) if run.problem else None,
            "figures": _figures(kind, chosen, result),
        }
        return page(request, "live.html", **told)


def _figures(kind: Kind, mode: Mode, result: Mapping[str, Any]) -> dict[str, float]:
    """The main numeric results: those by which accuracy is judged, else the first ones of the model; where the request
    is a whole engine, its own instead of those of a cylinder."""
    names = [name for name in kind.main_results if "." not in name] or [*kind.jobs[mode].result.model_fields]
    shown = {**result, **(result.get(kind.whole) or {})}
    found = {name: shown.get(name) for name in names if not name.endswith("_u")}
    numbers = {n: v for n, v in found.items() if isinstance(v, (int, float)) and not isinstance(v, bool)}
    return dict(list(numbers.items())[:_KEY_FIGURES])
