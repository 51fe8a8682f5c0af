"""Every further example solves, holds, and has a drawing and a form."""

from __future__ import annotations

import json

import pytest

from app.designs.pictures.drawing_svg import drawing_svg
from app.designs.registry import KINDS
from app.web.forms.tree import form_of

OTHERS = [(kind.slug, mode, title) for kind in KINDS.values() for mode in kind.jobs for title in kind.others(mode)]


@pytest.mark.parametrize(("slug", "mode", "title"), OTHERS)
def test_the_example_is_solved_and_holds(slug, mode, title):
    kind = KINDS[slug]
    job, spec, texts = kind.jobs[mode], kind.others(mode)[title], {}
    form_of(kind, mode).take(spec, texts)
    request = job.request.model_validate_json(json.dumps(form_of(kind, mode).value(texts)))
    assert request.contradictions() == []
    assert drawing_svg(kind.drawing(spec)).endswith("</svg>")
    answer = job.solve(request)
    assert answer.status == "succeeded"
    assert answer.verdict is None or answer.verdict["holds"], answer.verdict["summary"]
