"""Wording and layout of a kind's forms, in addition to its request models.

A kind without any gets a generic form: from the models' names, units, limits and descriptions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from app.designs.units import split_unit

Request = dict[str, Any]
"""A request as its JSON object."""


@dataclass(frozen=True)
class Switch:
    """A choice that is no field of the request: which of its fields are given. ``of`` infers it from a request."""

    label: str
    options: Mapping[str, str]
    of: Callable[[Request], str]
    section: str
    mode: str = ""


@dataclass(frozen=True)
class FormWords:
    """Wording and layout of a kind's fields, by dotted path in the request (without the member of a union) or by last
    name.

    sections  heading -> the request's own fields in order; "+" before a heading: initially collapsed
    labels, helps  replace the model's names and descriptions
    options   labels of a choice's values and of a union's members
    when      conditions under which a field applies: "name=value,value&name=value|name=value"
    always    optional fields that are shown at once; all others are added with a click
    sliders   numbers with a slider
    only      fields of one mode's form
    starts    initial values of a union's member that the example does not use, by path and member
    hidden    fields that are not part of the form
    columns   a table of points whose columns depend on a choice: path -> variant -> (columns, when)
    """

    sections: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    helps: Mapping[str, str] = field(default_factory=dict)
    options: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    when: Mapping[str, str] = field(default_factory=dict)
    always: frozenset[str] = frozenset()
    sliders: frozenset[str] = frozenset()
    only: Mapping[str, str] = field(default_factory=dict)
    starts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    hidden: frozenset[str] = frozenset()
    columns: Mapping[str, Mapping[str, tuple[tuple[str, ...], str]]] = field(default_factory=dict)
    switches: Mapping[str, Switch] = field(default_factory=dict)

    def label(self, path: str) -> str:
        """The label of a field: its wording, or its name with min and max spelled out."""
        label = look_up(self.labels, COMMON.labels, path)
        if label is not None:
            return label
        words = split_unit(path.rpartition(".")[2])[0]
        for short, long in (("min ", "least "), ("max ", "greatest ")):
            words = long + words.removeprefix(short) if words.startswith(short) else words
        return words[:1].upper() + words[1:]


COMMON = FormWords(
    sections={"+Accuracy, effects and time": ("effects", "effect_tolerance", "accuracy", "time_budget_s")},
    labels={
        "name": "Name of this run",
        "accuracy": "Accuracy wanted, relative",
        "effect_tolerance": "Effects may be left out up to",
        "effects": "Effects taken into account",
        "time_budget_s": "Time this design may take",
        "run_id": "Stored run",
        "instant": "Instant",
        "repair": "Repair points that are out of order",
        "poisson": "Poisson's ratio",
        "density_kg_m3": "Density",
        "elastic_modulus_gpa": "Elastic modulus E",
        "yield_strength_mpa": "Yield strength",
        "crank_radius_mm": "Crank radius r",
        "rod_length_mm": "Rod length L",
        "speed_hz": "Speed",
        "angle_deg": "crank angle",
        "pressure_mpa": "pressure",
        "volume_cm3": "volume",
        "back_pressure_mpa": "Pressure behind the piston",
        "clearance_volume_cm3": "Clearance volume",
        "strokes": "Points of the strokes",
    },
    helps={
        "name": "to find it again",
        "effects": "",
        "effect_tolerance": "by how much all effects that are left out may change the results together, relative",
        "time_budget_s": "empty: as long as the service allows; the best found so far is the answer",
        "accuracy": "of the computed results; 1e-6 is one millionth",
    },
    options={
        "effects": {"auto": "those that matter, by their influence", "all": "all of them", "choice": "my own choice"},
        "instant": {
            "": "the whole cycle",
            "gas_force_max": "greatest gas force",
            "rod_compression_max": "greatest compression of the rod",
            "rod_tension_max": "greatest tension of the rod",
            "side_force_max": "greatest side force",
            "wrist_pin_load_max": "greatest load of the wrist pin",
            "crank_pin_load_max": "greatest load of the crank pin",
            "main_bearing_load_max": "greatest load of the main bearing",
        },
    },
    always=frozenset({"time_budget_s", "back_pressure_mpa", "instant"}),
)
"""Wording shared by all kinds."""


def look_up(words: Mapping[str, Any], common: Mapping[str, Any], path: str) -> Any:
    """Look up a path: the kind's table before the common one, the whole path before its last name."""
    last = path.rpartition(".")[2]
    for table in (words, common):
        for name in (path, last):
            if name in table:
                return table[name]
    return None
