"""Templates, what they may call, and how a page is answered: nothing from elsewhere, no script but our own files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fastapi import Request
from fastapi.responses import HTMLResponse
from fastapi.templating import Jinja2Templates

from app.designs.registry import KINDS
from app.designs.units import split_unit
from app.web import verdicts

STATIC = Path(__file__).parent / "static"
POLICY = (
    "default-src 'self'; style-src 'self'; img-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"
)

templates = Jinja2Templates(Path(__file__).parent / "templates")
templates.env.globals["KINDS"] = KINDS


def figure(value: Any) -> str:
    """A value to the digits that a person reads."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def short(value: float) -> str:
    """Four digits, without a power of ten where a person would write none."""
    return f"{value:,.0f}".replace(",", "\u202f") if 9999.5 <= abs(value) < 1e7 else f"{value:.4g}"


def label(name: str) -> dict[str, str]:
    """A field's name in words, and its unit."""
    words, unit = split_unit(name)
    return {"words": words, "unit": unit}


def plain(name: object) -> str:
    """A name of the contract as words."""
    return str(name).replace("_", " ").replace("-", " ")


templates.env.filters["figure"] = figure
templates.env.filters["label"] = label
templates.env.filters["short"] = short
templates.env.filters["plain"] = plain
for _filter in (verdicts.standing, verdicts.reached, verdicts.required, verdicts.margin, verdicts.used):
    templates.env.filters[_filter.__name__] = _filter


def page(request: Request, name: str, status: int = 200, **context: Any) -> HTMLResponse:
    """A template as the answer."""
    response = templates.TemplateResponse(request, name, context, status_code=status)
    response.headers["Content-Security-Policy"] = POLICY
    response.headers["X-Content-Type-Options"] = "nosniff"
    return response
