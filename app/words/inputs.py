"""Inputs of a run in the sections, labels and order of its form, and the differences between two runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_args

from annotated_types import MaxLen
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from app.designs.form import COMMON, FormWords, look_up
from app.designs.kind import Kind, Mode
from app.designs.registry import KINDS, job_of
from app.designs.units import split_unit, tidy, with_unit
from app.words.languages import gettext as _
from app.words.units import in_sentence, told, unit_shown

_MAX_LISTED = 6
"""Maximum length of a list shown in full; of a longer one only the ends are shown, or what differs."""
_TAGS = ("kind", "method")
_Path = tuple[str, ...]


@dataclass(frozen=True)
class Input:
    """One input: dotted name, label (``words``), value in its metric ``unit``, labels of its choices, help.

    ``limits``: whether the value is a minimum and a maximum.
    """

    name: str
    words: str
    value: Any
    unit: str
    options: Mapping[str, str]
    limits: bool
    help: str

    @property
    def text(self) -> str:
        """The value with its unit, as displayed."""
        return self._said(_rounded)

    def text_beside(self, other: Input) -> str:
        """The text, as exact as it takes to tell the value from another one of the same input."""
        if self.text != other.text or self.value == other.value:
            return self.text
        if not isinstance(self.value, list) or len(self.value) <= _MAX_LISTED:
            return self._said(_exact)
        pairs = enumerate(zip(self.value, other.value, strict=True), start=1)
        found = [(place, self._told_apart(*pair)) for place, pair in pairs if pair[0] != pair[1]]
        listed = [_("value %(place)s: %(value)s") % {"place": n, "value": text} for n, text in found[:_MAX_LISTED]]
        return with_unit(", ".join(listed), unit_shown(self.unit)) + (", …" if len(found) > _MAX_LISTED else "")

    def _told_apart(self, item: Any, other: Any) -> str:
        """An item of a list, exact if rounding would make it the other one."""
        text, beside = (_shown(each, self.options, self.unit, _rounded) for each in (item, other))
        return _shown(item, self.options, self.unit, _exact) if text == beside else text

    def _said(self, figure: _Figure) -> str:
        if self.limits:
            text = " … ".join(_shown(end, self.options, self.unit, figure) for end in self.value)
        else:
            text = _shown(self.value, self.options, self.unit, figure)
        return with_unit(text, unit_shown(self.unit))


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
    for path, value, field in _leaves(_ordered(spec, model), model):
        if value is not None and value != [] and path != ("name",):
            found[_section(kind.form, path[0])].append(_input(kind, path, value, field))
    return [Group(_(title.removeprefix("+")), tuple(items)) for title, items in found.items() if items]


MORE = "More"
"""Section of inputs that no section names."""


def _section(words: FormWords, name: str) -> str:
    """The section of a field; fields of a method are in the section that selects the method."""
    sections = {**words.sections, **COMMON.sections}
    found = (title for wanted in (name, *_TAGS) for title, names in sections.items() if wanted in names)
    return next(found, MORE)


def differing(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[tuple[Input, str, str]]:
    """The inputs that differ, with their texts in both runs; "not given" if absent in one."""
    left, right = ({each.name: each for group in groups(run) for each in group.inputs} for run in (a, b))
    pairs = [(left.get(name), right.get(name)) for name in {**left, **right}]
    return [_side_by_side(*pair) for pair in pairs if _value(pair[0]) != _value(pair[1])]


def _value(found: Input | None) -> Any:
    return found.value if found else None


def _side_by_side(a: Input | None, b: Input | None) -> tuple[Input, str, str]:
    if a is None or b is None:
        return a or b, *(each.text if each else _("not given") for each in (a, b))
    return a, a.text_beside(b), b.text_beside(a)


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


def _leaves(
    value: Any, model: Any, path: _Path = (), field: FieldInfo | None = None
) -> Iterator[tuple[_Path, Any, FieldInfo | None]]:
    """(path, value, field of its model) of every leaf."""
    model = getattr(model, "root", model)
    if isinstance(value, dict):
        fields = type(model).model_fields if isinstance(model, BaseModel) else {}
        for name, inner in _ordered(value, model).items():
            yield from _leaves(inner, getattr(model, name, None), (*path, name), fields.get(name))
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, inner in enumerate(value):
            below = model[index] if isinstance(model, (list, tuple)) and index < len(model) else None
            yield from _leaves(inner, below, (*path, str(index + 1)), field)
    else:
        yield path, value, field


def _input(kind: Kind, path: _Path, value: Any, field: FieldInfo | None) -> Input:
    words, plain = kind.form, [part for part in path if not part.isdigit()]
    full_name = ".".join(plain)
    if plain[-1] in _TAGS and len(plain) > 1 and full_name not in words.labels:
        # The discriminator of a union is labelled as the union itself.
        full_name = ".".join(plain[:-1])
    sign = "± " if "uncertainty" in plain[:-1] else ""
    numbered = [part for part in path[1:] if part.isdigit()]
    own = (field.description or "") if field else ""
    help = look_up(words.helps, COMMON.helps, full_name)
    return Input(
        name=".".join(path),
        words=sign + " ".join([_(words.label(full_name)), *numbered]),
        value=value,
        unit=split_unit(plain[-1])[1] or split_unit(plain[0])[1],
        options=look_up(words.options, COMMON.options, full_name) or {},
        limits=isinstance(value, list) and field is not None and _is_pair(field),
        help=_(own.replace("null:", "empty:") if help is None else help),
    )


def _is_pair(field: FieldInfo) -> bool:
    """Whether a field that is a list may have two items only."""
    inside = (own for way in get_args(field.annotation) for own in getattr(way, "__metadata__", ()))
    return MaxLen(2) in [*field.metadata, *(limit for own in inside for limit in getattr(own, "metadata", ()))]


_Figure = Callable[[float, str], str]
"""How a number in its metric unit is written in the displayed one."""


def _rounded(value: float, unit: str) -> str:
    return tidy(f"{value:.10g}" if unit_shown(unit) == unit else f"{told(value, unit):.6g}")


def _exact(value: float, unit: str) -> str:
    return tidy(repr(told(value, unit)))


def _shown(value: Any, options: Mapping[str, str], unit: str, figure: _Figure) -> str:
    if isinstance(value, bool):
        return _("yes") if value else _("no")
    if isinstance(value, float):
        return figure(value, unit)
    if isinstance(value, list):
        if len(value) > _MAX_LISTED:
            first, last = (_shown(end, options, unit, figure) for end in (value[0], value[-1]))
            return _("%(count)s values, %(first)s … %(last)s") % {"count": len(value), "first": first, "last": last}
        return ", ".join(_shown(item, options, unit, figure) for item in value)
    return in_sentence(_(options.get(str(value), str(value).replace("_", " "))))
