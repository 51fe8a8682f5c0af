"""Pages of batches: list, submission of a file or a sweep, and progress and map of one batch."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections import Counter
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Form, Query, Request, Response, UploadFile
from fastapi.responses import HTMLResponse, RedirectResponse

from app.access.scopes import Scope
from app.batches.case_files import form_of
from app.batches.columns import column
from app.batches.fields import numbers
from app.batches.results import MEDIA_TYPES, Format, Wanted, points, unanswered
from app.batches.service import Asked, BatchService
from app.batches.sweep import Combine, Sweep
from app.batches.view import batch_json
from app.designs.kind import Kind, Mode
from app.designs.problems import INVALID
from app.designs.registry import KINDS
from app.designs.schema import entry
from app.designs.units import split_unit
from app.errors import PASSING, Problem, problem_of
from app.store.batch_reads import BatchFilter
from app.store.batch_records import ACTIVE, BatchRecord, BatchStatus
from app.store.errors import UnknownBatch, UnknownRun
from app.web.forms.faults import Faults, faults_of
from app.web.languages import COOKIE, UNITS_COOKIE, if_allowed, keep
from app.web.rendering import page
from app.web.sweep_form import VARIED_FIELDS, asked_in, placed_in
from app.words.fields import named, named_in, plain
from app.words.languages import Language, gettext, speaking
from app.words.solver_texts import spoken
from app.words.units import System, measuring

router = APIRouter(include_in_schema=False)
_PAGE_SIZE = 50
_READ_BYTES = 1 << 20
_MAX_UNANSWERED, _MAX_REASONS = 200, 20
"""Number of items without an answer that are looked at for their reasons, and of reasons shown; the downloads have
all."""
_MAX_PARALLEL_AXES = 12
"""Maximum number of parallel axes for varied fields."""


def _service(request: Request) -> BatchService:
    return request.app.state.batches


def _valid_kind_and_mode(kind: str, mode: str) -> tuple[str, str]:
    """The requested kind and mode, with defaults for unknown ones."""
    kind = kind if kind in KINDS else "pin-profile"
    modes = [str(each) for each in KINDS[kind].jobs]
    return kind, mode if mode in modes else modes[-1]


@router.get("/batches")
async def listing(
    request: Request, kind: str = "", mode: str = "", cursor: Annotated[str | None, Query(max_length=36)] = None
) -> HTMLResponse:
    """All batches, newest first, and the submission forms."""
    return await _list(request, kind, mode, cursor)


async def _list(
    request: Request,
    kind: str,
    mode: str,
    cursor: str | None = None,
    problem: dict[str, Any] | None = None,
    given: dict[str, str] | None = None,
    sweep_faults: Faults | None = None,
) -> HTMLResponse:
    found, following = await _service(request).list(BatchFilter(), cursor, _PAGE_SIZE)
    kind, mode = _valid_kind_and_mode(kind, mode)
    return page(
        request,
        "batches.html",
        problem["status"] if problem else 200,
        batches=[batch_json(batch) for batch in found],
        next_page=following,
        kind=kind,
        mode=mode,
        fields=numbers(kind, mode),
        varied=range(VARIED_FIELDS),
        ways=_ways(),
        problem=problem,
        faults=faults_of(problem),
        sweep_faults=sweep_faults or Faults(),
        given=given or {},
        kept_by=if_allowed(f"/batches/sweep?kind={kind}&mode={mode}", Scope.BATCH),
    )


def _ways() -> dict[str, str]:
    """Translated labels of the combinations."""
    return {
        Combine.GRID: gettext("every value with every other"),
        Combine.ZIP: gettext("side by side"),
        Combine.LATIN_HYPERCUBE: gettext("samples: Latin hypercube"),
        Combine.SOBOL: gettext("samples: Sobol"),
    }


def _words() -> dict[str, str]:
    """Translated labels of the item statuses."""
    return {
        "succeeded": gettext("succeeded"),
        "infeasible": gettext("infeasible"),
        "failed": gettext("failed"),
        "refused": gettext("refused"),
        "cancelled": gettext("cancelled"),
    }


@router.get("/batches/table")
async def table(kind: str = "", mode: str = "") -> Response:
    """CSV template: the header and the example as first row."""
    kind, mode = _valid_kind_and_mode(kind, mode)
    cells = dict(_cells(KINDS[kind].example(Mode(mode))))
    text = io.StringIO()
    csv.writer(text).writerows([list(cells), list(cells.values())])
    name = f'attachment; filename="{kind}-{mode}-cases.csv"'
    return Response(text.getvalue(), media_type="text/csv", headers={"Content-Disposition": name})


def _cells(value: dict[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for name, inner in value.items():
        if isinstance(inner, dict):
            found += _cells(inner, f"{prefix}{name}.")
        else:
            found.append((prefix + name, json.dumps(inner) if isinstance(inner, (list, bool)) else inner))
    return found


def _to(answer: bytes) -> Response:
    return RedirectResponse(json.loads(answer)["links"]["page"], status_code=303)


@router.post("/batches/upload")
async def upload(
    request: Request,
    cases: UploadFile,
    kind: Annotated[str, Form(max_length=64)],
    mode: Annotated[str, Form(max_length=16)],
    name: Annotated[str, Form(max_length=200)] = "",
) -> Response:
    """Submit a batch from an uploaded file."""
    service, form = _service(request), form_of(Path(cases.filename or ""))
    try:
        ask = Asked.of(kind, mode, name.replace("\0", "") or (cases.filename or "")[:200], "scalars")
        if form in ("text/csv", "application/x-ndjson"):
            return _to(await service.take_lines(ask, form == "text/csv", _parts(cases), None))
        if form == MEDIA_TYPES[Format.PARQUET]:
            return _to(await service.take_parquet(ask, cases.file, None, hashlib.sha256()))
        raise Problem(415, "No cases", "choose a .csv, .ndjson or .parquet file")
    except Problem as problem:
        return await _list(request, kind, mode, problem=problem.body)


async def _parts(cases: UploadFile) -> AsyncIterator[bytes]:
    while part := await cases.read(_READ_BYTES):
        yield part


@router.post("/batches/sweep")
async def sweep(request: Request, language: Language | None = None, units: System | None = None) -> Response:
    """Submit a sweep over a few fields of the example or of a stored run; with a ``language`` or ``units``, the form is
    shown again in those instead."""
    form = {name: str(value) for name, value in (await request.form()).items()}
    kind, mode = _valid_kind_and_mode(form.get("kind", ""), form.get("mode", ""))
    for chosen, use, cookie in ((language, speaking, COOKIE), (units, measuring, UNITS_COOKIE)):
        if chosen is not None:
            with use(chosen):
                shown = await _list(request, kind, mode, given=form)
            keep(shown, cookie, chosen)
            return shown
    try:
        base = await _base(request, form.get("run", "").strip(), kind, mode)
        asked = Sweep.read(json.dumps(asked_in(form, kind, mode, base)).encode())
        return _to(await _service(request).take_sweep(asked, None, hashlib.sha256()))
    except (Problem, *PASSING) as error:
        refused = problem_of(error)
        faults = placed_in(form, refused)
        shown = await _list(request, kind, mode, problem=refused.body, given=form, sweep_faults=faults)
        shown.headers.update(refused.headers)
        return shown


async def _base(request: Request, run_id: str, kind: str, mode: str) -> dict[str, Any]:
    if not run_id:
        return KINDS[kind].example(Mode(mode))
    try:
        run = await request.app.state.service.store.get(run_id)
    except UnknownRun:
        run = None
    if run is None or (run.kind, run.mode) != (kind, mode):
        told, allowed = gettext("is no run of this kind and mode"), gettext("the id of one")
        raise Problem(422, INVALID, told, [entry("/base", told, allowed)])
    return json.loads(run.spec)


async def _batch_of(request: Request, batch_id: str) -> BatchRecord:
    try:
        return await _service(request).get(batch_id)
    except UnknownBatch:
        raise Problem(404, "No such batch", "no batch has this id") from None


@router.get("/batches/sweep")
@router.get("/batches/upload")
async def back_to_batches() -> Response:
    """The page with the forms that are sent here: a login leads back to here."""
    return RedirectResponse("/batches", status_code=303)


@router.get("/batches/{batch_id}/cancel")
async def back_to_batch(request: Request, batch_id: str) -> Response:
    """The batch's page: a login leads back to here."""
    await _batch_of(request, batch_id)
    return RedirectResponse(f"/batches/{batch_id}", status_code=303)


@router.get("/batches/{batch_id}")
async def batch_page(request: Request, batch_id: str) -> HTMLResponse:
    """Page of one batch: progress, downloads and map."""
    batch = await _batch_of(request, batch_id)
    return page(
        request,
        "batch.html",
        batch=batch_json(batch),
        going=batch.status in ACTIVE,
        states={state: spoken(state) for state in BatchStatus},
        words=_words(),
        reasons=_reasons(await unanswered(_service(request).store, batch, _MAX_UNANSWERED)),
    )


def _reasons(items: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Why items have no answer: each reason once, with its items, the first of which are linked."""
    found: dict[str, dict[str, Any]] = {}
    for item in items:
        why = {"status": item["status"], "diagnosis": item["diagnosis"], "faults": _told(item["problem"])}
        reason = found.setdefault(json.dumps(why, sort_keys=True), {**why, "items": []})
        reason["items"].append(item)
    return list(found.values())[:_MAX_REASONS]


def _told(problem: dict[str, Any] | None) -> list[tuple[str, str]]:
    """Field and message of each error of an item, or its detail alone."""
    return faults_of(problem) or ([("", spoken(problem["detail"], keep_names=True))] if problem else [])


@router.get("/batches/{batch_id}/map")
async def map_points(
    request: Request,
    batch_id: str,
    x: Annotated[str, Query(max_length=200)] = "",
    y: Annotated[str, Query(max_length=200)] = "",
    colour: Annotated[str, Query(max_length=200)] = "",
    beside: Annotated[str, Query(max_length=2000, description="further fields, separated by commas")] = "",
) -> dict[str, Any]:
    """A sample of items as points, and the fields usable as axis or colour."""
    service = _service(request)
    batch = await service.get(batch_id)
    wanted = Wanted(fields=tuple(filter(None, dict.fromkeys((x, y, colour, *beside.split(",")[:_MAX_PARALLEL_AXES])))))
    told = await points(service.store, batch, wanted)
    kind = KINDS[batch.kind]
    return {**told, "words": _field_words(kind, batch.mode, told), "values": _value_words(kind, told)}


def _field_words(kind: Kind, mode: str, told: dict[str, Any]) -> dict[str, str]:
    """Labels of axes and colours in the page's language: varied fields as in the form, others by name, with the group
    that a result is in where another one has the same name."""
    last = Counter(name.rpartition(".")[2] for name in told["results"])
    results = {}
    for name in told["results"]:
        group, _, own = name.rpartition(".")
        words, unit = named_in(name)
        repeated = group and last[own] > 1 and not split_unit(group)[1]
        results[name] = _with_unit(f"{words} ({named(group)[0]})" if repeated else words, unit)
    return {
        **{name: _of_request(kind, mode, name) for name in told["varied"]},
        **results,
        **{name: plain(name) for name in ("governed_by", "status", "holds")},
        "accuracy.estimated": gettext("estimated error"),
    }


def _value_words(kind: Kind, told: dict[str, Any]) -> dict[str, str]:
    """Labels of the values that are no numbers, such as statuses and criteria."""
    values = {value for point in told["points"] for value in point[2:] if isinstance(value, (str, bool))}
    return {
        **{str(value).lower() if isinstance(value, bool) else value: _value(value) for value in values},
        **{name: gettext(label) for name, label in kind.labels.items() if name in values},
    }


def _of_request(kind: Kind, mode: str, name: str) -> str:
    """The label of a varied field, told from the result of the same name if there is one."""
    found = column(kind.slug, mode, name)
    field = name if found is None else found.path
    label = gettext(kind.form.label(_without_index(field)))
    return _named(label if field == name else gettext("%(label)s (requested)") % {"label": label}, name)


def _without_index(name: str) -> str:
    return ".".join(part for part in name.split(".") if not part.isdigit())


def _named(words: str, name: str) -> str:
    """The label with the unit of the field; range ends by index."""
    index = name.rpartition(".")[2]
    return _with_unit(f"{words} {int(index) + 1}" if index.isdigit() else words, named_in(_without_index(name))[1])


def _with_unit(words: str, unit: str) -> str:
    return f"{words}, {unit}" if unit else words


def _value(value: str | bool) -> str:
    if isinstance(value, bool):
        return gettext("yes") if value else gettext("no")
    return named(value)[0]


@router.post("/batches/{batch_id}/cancel")
async def cancel(request: Request, batch_id: str) -> Response:
    """Cancel a batch; finished items are kept."""
    await _service(request).cancel(batch_id)
    return RedirectResponse(f"/batches/{batch_id}", status_code=303)
