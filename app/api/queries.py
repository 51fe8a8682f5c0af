"""Queries of requests: a misspelt filter would otherwise be none and list everything, a misspelt kind list nothing."""

from __future__ import annotations

from collections import Counter

from fastapi import Request

from app.designs.problems import INVALID
from app.designs.refusals import json_pointer, with_suggestion
from app.designs.registry import KINDS
from app.designs.schema import entry
from app.errors import Problem


async def check_query_names(request: Request) -> None:
    """Raise Problem 422 for names that the route does not have, and for names given more than once."""
    if not request.scope["query_string"]:
        return
    known = [parameter.alias for parameter in request.scope["route"].dependant.query_params]
    found = []
    for name, times in Counter(name for name, _ in request.query_params.multi_items()).items():
        if name not in known:
            detail = with_suggestion("is no parameter of this address", name, known)
            found.append(entry(json_pointer([name]), detail, ", ".join(known) or "no query"))
        elif times > 1:
            found.append(entry(json_pointer([name]), "appears more than once", "each name once"))
    if found:
        raise Problem(422, INVALID, "the query has names that cannot be accepted", found)


def check_kind(kind: str | None) -> None:
    """Raise Problem 422 for a filter by a kind that does not exist; None filters nothing."""
    if kind is None or kind in KINDS:
        return
    found = entry("/kind", with_suggestion("is none of the kinds", kind, KINDS), ", ".join(KINDS))
    raise Problem(422, INVALID, "there is no such kind", [found])
