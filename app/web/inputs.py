"""What a run was asked, in the groups and the order of its request model, with units; and where two runs differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from app.designs.kind import Mode
from app.designs.registry import KINDS, job_of
from app.web.fields import named, split_unit
from app.web.forms.tree import form_of
from app.web.languages import gettext as _
from app.web.languages import language

_MOST_SHOWN = 6
"""Numbers of a list that are shown one by one; of a longer one the ends."""


@dataclass(frozen=True)
class Input:
    """One value that was asked for: its dotted name, words, text with unit, and what it means."""

    name: str
    words: str
    text: str
    help: str


@dataclass(frozen=True)
class Group:
    title: str
    inputs: tuple[Input, ...]


def groups(run: Mapping[str, Any]) -> list[Group]:
    """The run's spec without what was not given, single values of the request last."""
    spec = run["spec"].get("spec", run["spec"]) if run["mode"] == Mode.ACCURACY else run["spec"]
    model = _model(run, spec)
    told = _helps(run)
    ordered = _ordered(spec, model)
    found: dict[str, list[Input]] = {}
    for path, value, help in _leaves(ordered, model):
        if value is not None and value != [] and path != ("name",):
            found.setdefault(path[0] if len(path) > 1 else "", []).append(
                _input(path, value, told.get(".".join(path), "") if told else help)
            )
    rest = found.pop("", [])
    return [Group(named(name)[0], tuple(items)) for name, items in found.items()] + (
        [Group(_("request"), tuple(rest))] * bool(rest)
    )


def _helps(run: Mapping[str, Any]) -> dict[str, str]:
    """What the form says of its fields, by path, where the page is not in English: the model's own descriptions are."""
    mode = Mode(run["mode"])
    if language() == "en" or mode not in KINDS[run["kind"]].jobs:
        return {}
    return {part.path: part.help for part in form_of(KINDS[run["kind"]], mode).every() if part.path}


def differing(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[tuple[Input, str, str]]:
    """The inputs that differ, each with its text in either run; "not given" where it is in one only."""
    left, right = ({each.name: each for group in groups(run) for each in group.inputs} for run in (a, b))
    names = [*left, *(name for name in right if name not in left)]
    return [
        (left.get(name) or right[name], _text(left.get(name)), _text(right.get(name)))
        for name in names
        if _text(left.get(name)) != _text(right.get(name))
    ]


def _text(found: Input | None) -> str:
    return found.text if found else _("not given")


def _model(run: Mapping[str, Any], spec: Mapping[str, Any]) -> Any:
    """The request as its model, None where a model of today cannot read a spec of before."""
    kind = KINDS[run["kind"]]
    modes = [Mode(run["mode"])] if run["mode"] != Mode.ACCURACY else list(kind.jobs)
    for mode in modes:
        try:
            return job_of(kind, mode).request.model_validate(spec)
        except ValidationError:
            continue
    return None


def _ordered(spec: Mapping[str, Any], model: Any) -> dict[str, Any]:
    model = getattr(model, "root", model)
    names = [*type(model).model_fields] if isinstance(model, BaseModel) else []
    return {name: spec[name] for name in [*names, *(n for n in spec if n not in names)] if name in spec}


def _leaves(value: Any, model: Any, path: tuple[str, ...] = (), help: str = "") -> Iterator[tuple[Any, Any, str]]:
    model = getattr(model, "root", model)
    if isinstance(value, dict):
        fields = type(model).model_fields if isinstance(model, BaseModel) else {}
        for name, inner in _ordered(value, model).items():
            told = (fields[name].description or "") if name in fields else ""
            yield from _leaves(inner, getattr(model, name, None), (*path, name), told)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, inner in enumerate(value):
            below = model[index] if isinstance(model, (list, tuple)) and index < len(model) else None
            yield from _leaves(inner, below, (*path, str(index + 1)), help)
    else:
        yield path, value, help


def _input(path: tuple[str, ...], value: Any, help: str) -> Input:
    words, unit = named(path[-1])
    if not unit and len(path) > 1:
        unit = split_unit(path[0])[1]
    numbered = [part for part in path[1:-1] if part.isdigit()]
    words = " ".join([*(named(part)[0] for part in path[1:-1] if not part.isdigit()), words, *numbered])
    return Input(".".join(path), words, f"{_shown(value)} {unit}".rstrip(), help)


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return _("yes") if value else _("no")
    if isinstance(value, float):
        return f"{value:.10g}"
    if isinstance(value, list):
        if len(value) == 2 and all(isinstance(item, (int, float)) for item in value):
            return f"{_shown(value[0])} … {_shown(value[1])}"
        if len(value) > _MOST_SHOWN:
            ends = {"first": _shown(value[0]), "last": _shown(value[-1])}
            return _("%(count)s values, %(first)s … %(last)s") % {"count": len(value), **ends}
        return ", ".join(map(_shown, value))
    return _(str(value).replace("_", " "))
