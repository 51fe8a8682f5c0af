"""Refusals and failures as pages, for whoever asks for HTML; the API keeps its problem details."""

from __future__ import annotations

from fastapi import Request
from fastapi.responses import Response

from app.errors import Problem
from app.web.rendering import page

_OPERATION = ("/api/", "/healthz", "/readyz", "/metrics", "/openapi.json", "/static/")


def problem_page(request: Request, problem: Problem) -> Response | None:
    """The page of a problem; None where the client is a program."""
    if request.url.path.startswith(_OPERATION) or "text/html" not in request.headers.get("accept", ""):
        return None
    response = page(request, "problem.html", problem.status, problem=problem.body)
    response.headers.update(problem.headers)
    return response
