"""The form of a sweep: the request that is entered, and its errors at the inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.batches.sweep import SAMPLED
from app.designs.problems import INVALID
from app.designs.schema import entry
from app.errors import Problem
from app.web.forms.faults import Faults, said
from app.web.forms.numbers import number
from app.words.languages import gettext as _

VARIED_FIELDS = 3
"""Number of varied fields in the form; files and the API allow more."""


def asked_in(form: Mapping[str, str], kind: str, mode: str, base: dict[str, Any]) -> dict[str, Any]:
    """The sweep over ``base``; text that is no number is kept for the request to refuse.

    Raises Problem if a field is entered twice.
    """
    way = form.get("combine", "grid")
    vary: dict[str, Any] = {}
    for k in range(VARIED_FIELDS):
        field = form.get(f"field{k}", "").strip()
        if field in vary:
            told = _("is entered twice")
            raise Problem(422, INVALID, told, [entry(f"/vary/{field}", told, _("every field once"))])
        if field:
            ends = {"from": _number(form.get(f"from{k}", "")), "to": _number(form.get(f"to{k}", ""))}
            steps = {} if way in SAMPLED else {"steps": _number(form.get(f"steps{k}", ""), whole=True)}
            vary[field] = {**ends, **steps, "scale": "log" if form.get(f"log{k}") else "linear"}
    found: dict[str, Any] = {"kind": kind, "mode": mode, "name": form.get("name", ""), "base": base, "vary": vary}
    if way in SAMPLED:
        found["samples"] = _number(form.get("samples", ""), whole=True)
    return {**found, "combine": way}


def _number(text: str, whole: bool = False) -> float | int | str | None:
    found = number(text) if text.strip() else None
    return int(found) if whole and isinstance(found, float) and found.is_integer() else found


def placed_in(form: Mapping[str, str], problem: Problem) -> Faults:
    """Assign each entry of a problem with the sweep of a submitted form to the input it is about; none if the problem
    has no entries."""
    at: dict[str, str] = {}
    labels: dict[str, str] = {}
    elsewhere: list[str] = []
    for each in problem.body.get("errors", ()):
        # Fields are entered by their own names.
        words = said(each, {}, keep_names=True)
        name, label = _input(form, each["pointer"])
        if name:
            at.setdefault(name, words)
            labels[name] = label
        else:
            elsewhere.append(f"{each['pointer'].strip('/')} {words}".strip())
    return Faults(at, labels, tuple(elsewhere))


def _input(form: Mapping[str, str], pointer: str) -> tuple[str, str]:
    """Name and label of the input for a pointer into the sweep; empty if there is none."""
    part, *inner = pointer.strip("/").split("/")
    if part == "samples":
        return "samples", _("Number of samples, instead of steps")
    if part == "base":
        return "run", _("Run to vary, by its id; empty: the example")
    if part != "vary":
        return "", ""
    varied, *ends = inner or [form.get("field0", "").strip()]
    k = next((k for k in range(VARIED_FIELDS) if form.get(f"field{k}", "").strip() == varied), 0)
    field = f"{_('Field')} {k + 1}"
    words = {"from": _("From"), "to": _("To"), "steps": _("Steps"), "scale": _("logarithmic")}
    end = ends[0] if ends and ends[0] in words else ""
    name = {"": "field", "scale": "log"}.get(end, end)
    return f"{name}{k}", f"{field}, {words[end]}" if end else field
