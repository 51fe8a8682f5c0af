"""Error pages for clients that accept HTML; the API keeps its problem details."""

from __future__ import annotations

from fastapi import Request
from fastapi.responses import Response

from app.errors import Problem
from app.web.languages import preferred, units_of
from app.web.rendering import page
from app.words.languages import speaking
from app.words.units import measuring

_MACHINE_PATHS = ("/api/", "/healthz", "/readyz", "/metrics", "/openapi.json", "/static/")


def problem_page(request: Request, problem: Problem) -> Response | None:
    """The error page of a problem; None for API paths and clients that do not accept HTML."""
    if request.url.path.startswith(_MACHINE_PATHS) or "text/html" not in request.headers.get("accept", ""):
        return None
    with speaking(preferred(request.headers)), measuring(units_of(request.headers)):
        response = page(request, "problem.html", problem.status, problem=problem.body)
    response.headers.update(problem.headers)
    return response
