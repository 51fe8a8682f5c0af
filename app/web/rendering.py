"""Template environment and page responses. No third-party assets; scripts only from local files."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fastapi import Request, Response
from fastapi.responses import HTMLResponse
from fastapi.templating import Jinja2Templates
from jinja2 import pass_context
from markupsafe import Markup

from app.access.csrf import FIELD
from app.access.sessions import session
from app.designs.registry import KINDS
from app.designs.units import figures, power, quantity, tidy
from app.designs.verdict import accuracy_met
from app.runs import met
from app.words import units, verdicts
from app.words.fields import named, plain
from app.words.languages import LANGUAGES, gettext, language, ngettext
from app.words.solver_texts import is_foreign, spoken

STATIC = Path(__file__).parent / "static"
POLICY = (
    "default-src 'self'; style-src 'self'; img-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"
)

templates = Jinja2Templates(Path(__file__).parent / "templates")
templates.env.globals["KINDS"] = KINDS
templates.env.globals["LANGUAGES"] = LANGUAGES
templates.env.add_extension("jinja2.ext.i18n")
templates.env.policies["ext.i18n.trimmed"] = True
templates.env.install_gettext_callables(gettext, ngettext, newstyle=True)  # type: ignore[attr-defined]


def figure(value: Any, unit: str = "", digits: int = 6) -> str:
    """A value to ``digits`` significant digits in the selected units, without an exponent below 1e7."""
    if isinstance(value, bool):
        return gettext("yes") if value else gettext("no")
    return figures(units.told(value, unit), digits) if isinstance(value, float) else str(value)


def uncertain(value: float, spread: float, unit: str = "") -> str:
    """A value and its standard uncertainty: two digits of it, and the value to the same place."""
    value, spread = units.told(value, unit), units.told(spread, unit)
    places = max(0, 1 - math.floor(math.log10(spread)))
    return f"{value:.{places}f} ±\u00a0{spread:.{places}f}"


def short(value: float, unit: str = "") -> str:
    """Four significant digits, without an exponent below 1e7."""
    value = units.told(value, unit)
    return f"{value:,.0f}".replace(",", "\u202f") if 9999.5 <= abs(value) < 1e7 else tidy(f"{value:.4g}")


def label(name: str) -> dict[str, str]:
    """A field's label in the page's language, its displayed unit and its metric unit."""
    words, unit = named(name)
    return {"words": words, "unit": units.unit_shown(unit), "metric": unit}


def foreign(text: str) -> Markup:
    """The ``lang="en"`` attribute for a solver text without a translation on a non-English page."""
    return Markup(' lang="en"') if is_foreign(text) else Markup()


def first_upper(text: str) -> str:
    """Capitalise the first letter only."""
    return text[:1].upper() + text[1:]


def back_of(request: Request) -> str:
    """The current path and query, as return target of the language selection."""
    return request.url.path + (f"?{request.url.query}" if request.url.query else "")


def add_filter(name: str, function: Callable[..., Any]) -> None:
    """Add a filter that is applied whenever a page is rendered.

    Without a context, Jinja2 applies a filter to a constant when it compiles the template: in the language and units of
    whoever asks first.
    """

    @pass_context
    def applied(_context: Any, *given: Any, **named_ones: Any) -> Any:
        return function(*given, **named_ones)

    templates.env.filters[name] = applied


for _filter in (
    *(figure, figures, uncertain, met, accuracy_met, power, label, short),
    *(plain, spoken, foreign, first_upper, quantity),
    *(verdicts.standing, verdicts.reached, verdicts.required, verdicts.margin, verdicts.used, verdicts.summary),
):
    add_filter(_filter.__name__, _filter)
add_filter("unit", units.unit_shown)
templates.env.globals["SYSTEMS"] = units.SYSTEMS
templates.env.globals["system"] = units.system
templates.env.globals["back_of"] = back_of
templates.env.globals["language"] = language


def page(request: Request, name: str, status: int = 200, **context: Any) -> HTMLResponse:
    """Render a template as a response with the security and language headers."""
    context["session"] = own = session.get()
    response = templates.TemplateResponse(request, name, context, status_code=status)
    if own is not None:
        _insert_csrf_tokens(response, own.csrf)
    response.headers["Content-Language"] = language()
    response.headers["Vary"] = "Cookie, Accept-Language"
    response.headers["Content-Security-Policy"] = POLICY
    return response


_POST_FORM = re.compile(rb'<form method="post"[^>]*>')


def _insert_csrf_tokens(response: Response, token: str) -> None:
    """Insert the CSRF token into every POST form, so that no template can omit it."""
    field = f'<input type="hidden" name="{FIELD}" value="{token}">'.encode()
    response.body = _POST_FORM.sub(lambda found: found[0] + field, bytes(response.body))
    response.headers["Content-Length"] = str(len(response.body))
    response.headers["Cache-Control"] = "no-store"
