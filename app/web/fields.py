"""Forms from requests: a request as a flat list of fields, and the fields back into a request.

The kind's own example says which fields there are and what they start with; the request model alone judges them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

UNITS = {
    "_n_m2": "N/m²", "_kg_m3": "kg/m³", "_kg_m2": "kg·m²", "_n_m": "N/m", "_mm2": "mm²", "_cm3": "cm³", "_nm": "N·m",
    "_m_s": "m/s", "_nmm": "N·mm", "_mpa": "MPa", "_gpa": "GPa", "_rad": "rad", "_deg": "°", "_hz": "Hz",
    "_kg": "kg", "_mm": "mm", "_um": "µm", "_g": "g", "_n": "N", "_w": "W", "_j": "J", "_s": "s",
}  # fmt: skip


@dataclass(frozen=True)
class FormField:
    """One input: its name in the form (dotted path), JSON pointer, label, unit, text, and what is wrong with it."""

    name: str
    pointer: str
    group: str
    label: str
    unit: str
    text: str
    numeric: bool
    error: str = ""


def split_unit(name: str) -> tuple[str, str]:
    """A field's name as words and its unit: ``crank_radius_mm`` → (crank radius, mm)."""
    for ending, unit in UNITS.items():
        if name.endswith(ending) and len(name) > len(ending):
            return name.removesuffix(ending).replace("_", " "), unit
    return name.replace("_", " "), ""


def _leaves(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _leaves(inner, (*path, name))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _leaves(inner, (*path, str(index)))
    else:
        yield path, value


def form_fields(
    example: dict[str, Any], filled: Mapping[str, str] | None = None, errors: Mapping[str, str] | None = None
) -> list[FormField]:
    """The fields of a request like the example, with what the user typed and what was wrong with it."""
    out = []
    for path, value in _leaves(example):
        name, pointer = ".".join(path), "/" + "/".join(path)
        words, unit = split_unit(path[-2] if path[-1].isdigit() else path[-1])
        group, unit_of_group = split_unit(path[0])
        ends = {"0": ", least", "1": ", greatest"}
        text = "" if value is None else str(value)
        out.append(
            FormField(
                name=name,
                pointer=pointer,
                group=group if len(path) > 1 else "request",
                label=words + (ends.get(path[-1], "") if not isinstance(value, str) else ""),
                unit=unit or (unit_of_group if len(path) > 1 else ""),
                text=text if filled is None else filled.get(name, ""),
                numeric=value is None or isinstance(value, (int, float)),
                error=(errors or {}).get(pointer, ""),
            )
        )
    return out


def request_from(example: dict[str, Any], filled: Mapping[str, str]) -> dict[str, Any]:
    """The request that the filled form means: empty numbers are null, what is no number stays the text it is."""

    def build(value: Any, path: tuple[str, ...]) -> Any:
        if isinstance(value, dict):
            return {name: build(inner, (*path, name)) for name, inner in value.items()}
        if isinstance(value, list):
            built = [build(inner, (*path, str(index))) for index, inner in enumerate(value)]
            # A word taken out of a list of words is no longer in the list.
            return [item for item in built if item != ""]
        text = filled.get(".".join(path), "").strip()
        if value is not None and not isinstance(value, (int, float)):
            return text
        if not text:
            return None
        try:
            number = float(text)
        except ValueError:
            return text
        return number if math.isfinite(number) else text

    return build(example, ())
