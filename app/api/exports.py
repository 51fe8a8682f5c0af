"""GET /api/v1/runs/{id}/exports/{name}: files made from a run."""

from __future__ import annotations

import json
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.responses import HTMLResponse

from app.api.queries import check_query_names
from app.api.validators import NOT_MODIFIED, with_tag
from app.exports.export import ExportOptions, Tool
from app.exports.parameters import PARAMETERS
from app.exports.registry import EXPORTS
from app.run_exports import RunExports
from app.submission import Service
from app.words.languages import Language, language
from app.words.languages import gettext as _

router = APIRouter(prefix="/api/v1/runs", tags=["runs"], dependencies=[Depends(check_query_names)])
_RETRY_S = 2


def _content(form: str) -> dict[str, Any]:
    """The schema of a file of that media type: JSON of some form, or bytes."""
    return {} if form == "application/json" else {"type": "string", "format": "binary"}


_RESPONSES: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "the file; its name is made from the run's kind and id",
        "content": {form: {"schema": _content(form)} for export in EXPORTS.values() for form in export.media_types},
    },
    202: {
        "description": "the file is being made: ask again after `Retry-After` seconds",
        "content": {form: {"schema": _content(form)} for form in ("application/json", "text/html")},
    },
    **NOT_MODIFIED,
    404: {"description": "there is no such run, or no such export"},
    409: {"description": "the run has no result, or nothing for this format"},
    501: {"description": "the format needs an extra that is not installed; the problem names it"},
    504: {"description": "the file took longer to generate than the solve time limit of the service"},
}


@router.get(
    "/{run_id}/exports/{export}", summary="A file made from a run", response_class=Response, responses=_RESPONSES
)
async def run_export(
    request: Request,
    run_id: str,
    export: str,
    tool: Annotated[
        Tool, Query(alias="for", description="parameters export only: the CAD program that reads the file")
    ] = (Tool.FREECAD),
    angle_deg: Annotated[
        float | None,
        Query(ge=-3600, le=3600, allow_inf_nan=False, description="linkage only: crank angle; default: at the blow"),
    ] = None,
    report_language: Annotated[Language, Query(alias="language", description="language of a report")] = Language.EN,
) -> Response:
    """One of the run's exports, as its `links.exports` lists them."""
    service: Service = request.app.state.service
    exports: RunExports = request.app.state.exports
    run = json.loads(await service.as_json(run_id, complete=True))
    made = await exports.file(run, export, ExportOptions(tool, angle_deg, report_language))
    if made is None:
        return _later(request, run["id"])
    # Next to the results' own table, two programs' parameters are CSV files too.
    part = f"-{export}-{tool}" if export == PARAMETERS.name else ""
    name = f"{run['kind']}-{run['id']}{part}.{made.extension}"
    headers = {
        "Content-Disposition": f'attachment; filename="{name}"',
        "Cache-Control": "private, max-age=3600",
        "X-Content-Type-Options": "nosniff",
    }
    return with_tag(request, Response(made.content, media_type=made.media_type, headers=headers))


def _later(request: Request, run_id: str) -> Response:
    """Respond 202: retry later. A browser refreshes by itself (a link with ``download`` would save this answer)."""
    headers = {"Retry-After": str(_RETRY_S), "Cache-Control": "no-store"}
    if "text/html" in request.headers.get("accept", ""):
        title, said = _("One moment"), _("The file is being made; the download starts by itself.")
        back = f'<a href="/runs/{run_id}">{_("Run")}</a>'
        page = f'<!doctype html><html lang="{language()}"><title>{title}</title><p>{said} {back}'
        return HTMLResponse(page, 202, headers | {"Refresh": str(_RETRY_S)})
    body = {"status": "being made", "retry_after_s": _RETRY_S}
    return Response(json.dumps(body), 202, headers, "application/json")
