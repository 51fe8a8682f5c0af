"""Inputs of a run in the sections, labels and order of its form, and the differences between two runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from app.designs.form import COMMON, FormWords, look_up
from app.designs.kind import Kind, Mode
from app.designs.registry import KINDS, job_of
from app.designs.units import split_unit, tidy, with_unit
from app.words.languages import gettext as _
from app.words.units import told, unit_shown

_MAX_LISTED = 6
"""Maximum length of a list shown in full; of a longer one only the ends are shown."""
_TAGS = ("kind", "method")
_Path = tuple[str, ...]


@dataclass(frozen=True)
class Input:
    """One input value: dotted name, label (``words``), text with unit, help."""

    name: str
    words: str
    text: str
    help: str


@dataclass(frozen=True)
class Group:
    title: str
    inputs: tuple[Input, ...]


def groups(run: Mapping[str, Any]) -> list[Group]:
    """The given inputs of a run, grouped in the sections of the form."""
    kind = KINDS[run["kind"]]
    spec = run["spec"].get("spec", run["spec"]) if run["mode"] == Mode.ACCURACY else run["spec"]
    model = _model(run, spec)
    titles = [*dict.fromkeys([*kind.form.sections, MORE, *COMMON.sections])]
    found: dict[str, list[Input]] = {title: [] for title in titles}
    for path, value, own in _leaves(_ordered(spec, model), model):
        if value is not None and value != [] and path != ("name",):
            found[_section(kind.form, path[0])].append(_input(kind, path, value, own))
    return [Group(_(title.removeprefix("+")), tuple(items)) for title, items in found.items() if items]


MORE = "More"
"""Section of inputs that no section names."""


def _section(words: FormWords, name: str) -> str:
    """The section of a field; fields of a method are in the section that selects the method."""
    sections = {**words.sections, **COMMON.sections}
    found = (title for wanted in (name, *_TAGS) for title, names in sections.items() if wanted in names)
    return next(found, MORE)


def differing(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[tuple[Input, str, str]]:
    """The differing inputs with their texts in both runs; "not given" if absent in one."""
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
    """The spec as request model; None for a spec of an incompatible earlier version."""
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


def _leaves(value: Any, model: Any, path: _Path = (), told: str = "") -> Iterator[tuple[_Path, Any, str]]:
    """(path, value, field description) of every leaf."""
    model = getattr(model, "root", model)
    if isinstance(value, dict):
        fields = type(model).model_fields if isinstance(model, BaseModel) else {}
        for name, inner in _ordered(value, model).items():
            own = (fields[name].description or "") if name in fields else ""
            yield from _leaves(inner, getattr(model, name, None), (*path, name), own)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, inner in enumerate(value):
            below = model[index] if isinstance(model, (list, tuple)) and index < len(model) else None
            yield from _leaves(inner, below, (*path, str(index + 1)), told)
    else:
        yield path, value, told


def _input(kind: Kind, path: _Path, value: Any, own: str) -> Input:
    words, plain = kind.form, [part for part in path if not part.isdigit()]
    full_name = ".".join(plain)
    if plain[-1] in _TAGS and len(plain) > 1 and full_name not in words.labels:
        # The discriminator of a union is labelled as the union itself.
        full_name = ".".join(plain[:-1])
    unit = split_unit(plain[-1])[1] or split_unit(plain[0])[1]
    sign = "± " if "uncertainty" in plain[:-1] else ""
    numbered = [part for part in path[1:] if part.isdigit()]
    help = look_up(words.helps, COMMON.helps, full_name)
    return Input(
        ".".join(path),
        sign + " ".join([_(words.label(full_name)), *numbered]),
        with_unit(_shown(value, look_up(words.options, COMMON.options, full_name) or {}, unit), unit_shown(unit)),
        _(own.replace("null:", "empty:") if help is None else help),
    )


def _shown(value: Any, options: Mapping[str, str], unit: str = "") -> str:
    if isinstance(value, bool):
        return _("yes") if value else _("no")
    if isinstance(value, float):
        return tidy(f"{value:.10g}" if unit_shown(unit) == unit else f"{told(value, unit):.6g}")
    if isinstance(value, list):
        if len(value) == 2 and all(isinstance(item, (int, float)) for item in value):
            return f"{_shown(value[0], options, unit)} … {_shown(value[1], options, unit)}"
        if len(value) > _MAX_LISTED:
            ends = {"first": _shown(value[0], options, unit), "last": _shown(value[-1], options, unit)}
            return _("%(count)s values, %(first)s … %(last)s") % {"count": len(value), **ends}
        return ", ".join(_shown(item, options, unit) for item in value)
    return _(options.get(str(value), str(value).replace("_", " ")))
