"""Builds the form tree from the JSON schema of a request model."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from app.designs.form import COMMON, look_up
from app.designs.kind import Kind, Mode
from app.designs.schema import MAX_TIME_S
from app.designs.units import split_unit
from app.web.forms.groups import Group, Member, Range, Union
from app.web.forms.nodes import Choice, Constant, Effects, Flag, Node, Number, Several, Switched, Text
from app.web.forms.schemas import TAGS, Schema, allowed, first_sentence, help_of, is_numbers, tag_of
from app.web.forms.tables import Column, Numbers, Table
from app.words.languages import gettext as _
from app.words.languages import language
from app.words.units import in_sentence, system


def form_of(kind: Kind, mode: Mode, longest_s: float = MAX_TIME_S) -> Group:
    """The form of a kind and mode in the current language and units (cached), as a group of sections.

    ``longest_s``: the service's time limit per solve [s], offered as the greatest time budget.
    """
    return _form_in(kind, mode, longest_s, language(), system())


@cache
def _form_in(kind: Kind, mode: Mode, longest_s: float, _language: str, _system: str) -> Group:
    return build(kind, mode, longest_s)


def build(kind: Kind, mode: Mode, longest_s: float = MAX_TIME_S) -> Group:
    """Build the form, uncached."""
    return _Builder(kind, mode, longest_s).form()


class _Builder:
    def __init__(self, kind: Kind, mode: Mode, longest_s: float) -> None:
        self._kind, self._mode, self._words, self._longest_s = kind, mode, kind.form, longest_s
        self._root: Schema = kind.jobs[mode].request.model_json_schema()

    def form(self) -> Group:
        root = self._root
        if "oneOf" in root:
            return self._of_union(root)
        return Group(key="", name="", pointer="", path="", children=self._sections(self._children(root, "", "", "")))

    def _of_union(self, root: Schema) -> Group:
        """The form of a union request: the choice with each member's fields, then the shared fields."""
        models = [self._resolved(s) for s in root["oneOf"]]
        shared = set.intersection(*(set(m["properties"]) for m in models))
        shared = {n for n in shared if all(m["properties"][n] == models[0]["properties"][n] for m in models)}
        common = self._children({"properties": {n: models[0]["properties"][n] for n in shared}}, "", "", "")
        key = next(tag for tag in TAGS if tag in models[0]["properties"])
        members = []
        for model in models:
            tag = model["properties"][key]["const"]
            own = {**model, "properties": {n: s for n, s in model["properties"].items() if n not in shared}}
            children = self._children(own, f"{tag}.", "", "")
            part = Group(
                key="",
                name=tag,
                pointer="",
                path="",
                help=_(first_sentence(model)),
                when=f"{key}={tag}",
                children=children,
            )
            start = self._words.starts.get(key, {}).get(tag, {})
            members.append(Member(tag, lambda v, t=tag: isinstance(v, Mapping) and v.get(key) == t, start, part))
        union = Union(
            key="",
            name=key,
            pointer=f"/{key}",
            path=key,
            label=_(self._words.label(key)),
            members=tuple(members),
            options=self._options(key, [m.tag for m in members]),
        )
        return Group(key="", name="", pointer="", path="", children=self._sections((union, *common)))

    def _sections(self, children: tuple[Node, ...]) -> tuple[Node, ...]:
        """Nodes grouped into sections; unassigned ones go before the common sections."""
        switches = {name: s for name, s in self._words.switches.items() if s.mode in ("", self._mode)}
        left: dict[str, list[Node]] = {}
        for child in children:
            if self._only(child.path):
                left.setdefault(child.path, []).append(child)
        left_over = "More"
        sections = {**self._words.sections, left_over: (), **COMMON.sections}
        named = {path for paths in sections.values() for path in paths}
        out = []
        for number, (title, paths) in enumerate(sections.items(), start=1):
            found: list[Node] = [self._switch(n, s) for n, s in switches.items() if s.section == title]
            wanted = paths or tuple(path for path in left if path not in named and path != "name")
            found += [child for path in wanted for child in left.get(path, ())]
            if found:
                heading = title.removeprefix("+")
                out.append(
                    Group(
                        key="",
                        name=f"section-{number}",
                        pointer="",
                        path="",
                        label=_(heading),
                        children=tuple(found),
                        closed=title.startswith("+"),
                    )
                )
        return (*left.get("name", ()), *out)

    @staticmethod
    def _switch(name: str, switch: Any) -> Node:
        return Switched(
            key="",
            name=name,
            pointer="",
            path="",
            label=_(switch.label),
            options={value: _(words) for value, words in switch.options.items()},
            values={value: value for value in switch.options},
            of=switch.of,
        )

    def _only(self, path: str) -> bool:
        return self._words.only.get(path, self._mode) == self._mode and path not in self._words.hidden

    def _resolved(self, schema: Schema) -> Schema:
        if "$ref" in schema:
            found = self._root["$defs"][schema["$ref"].rpartition("/")[2]]
            return {**found, **{k: v for k, v in schema.items() if k != "$ref"}}
        return schema

    def _children(self, model: Schema, prefix: str, path: str, unit: str) -> tuple[Node, ...]:
        """Nodes of an object; ``prefix`` is prepended to input names, ``path`` to field paths."""
        required, out = set(model.get("required", ())), []
        properties = {n: self._resolved(s) for n, s in model["properties"].items()}
        lists = [n for n, s in properties.items() if n in required and is_numbers(s)]
        for key, schema in properties.items():
            here = f"{path}.{key}" if path else key
            if schema.get("description", "").startswith("filled in") or not self._only(here):
                continue
            if len(lists) > 1 and key in lists:
                if key == lists[0]:
                    out.append(self._table(prefix + key, path, here, self._columns(properties, lists), "columns", ""))
                continue
            out += self._nodes(key, schema, key in required, prefix, here, unit)
        return tuple(out)

    def _nodes(self, key: str, schema: Schema, required: bool, prefix: str, path: str, unit: str) -> list[Node]:
        nullable, default = False, schema.get("default")
        if "anyOf" in schema:
            members = [s for s in schema["anyOf"] if s.get("type") != "null"]
            nullable = len(members) < len(schema["anyOf"])
            schema = {**self._resolved(members[0]), **{k: v for k, v in schema.items() if k != "anyOf"}}
        if key == "time_budget_s":
            schema = {**schema, "maximum": self._longest_s}
        unit = split_unit(key)[1] or unit
        own = help_of(schema, nullable)
        said = look_up(self._words.helps, COMMON.helps, path)
        shared: dict[str, Any] = {
            "key": key,
            "name": prefix + key,
            "pointer": "/" + path.replace(".", "/"),
            "path": path,
            "label": _(self._words.label(path)),
            "help": _(own if said is None else said),
            "when": self._words.when.get(path, ""),
        }
        adds = nullable and default is None and not {path, key} & (self._words.always | COMMON.always)
        adds = adds and "null:" not in schema.get("description", "") and not self._words.when.get(path)
        if key == "effects":
            known = {e.name: _(e.summary) for e in self._kind.known_effects}
            return (
                [Effects(**shared, options=self._options(path, ["auto", "all", "choice"]), known=known)]
                if known
                else []
            )
        if "oneOf" in schema:
            return [self._union(schema, shared, prefix, path, unit)]
        if "const" in schema:
            return [Constant(**shared, constant=schema["const"])]
        if key == "run_id":
            return [Choice(**shared, options={}, values={}, runs=True)]
        if "enum" in schema:
            values = {str(v): v for v in schema["enum"]}
            values = {"": None, **values} if nullable else values
            return [Choice(**shared, options=self._options(path, list(values)), values=values, start=default)]
        return self._plain(schema, shared, nullable, adds, unit, default)

    def _plain(
        self, schema: Schema, shared: dict[str, Any], nullable: bool, adds: bool, unit: str, default: Any
    ) -> list[Node]:
        path, name = shared["path"], shared["name"]
        match schema["type"]:
            case "object":
                children = self._children(schema, f"{name}.", path, unit)
                # Nested headings only where explicitly worded.
                shared["help"] = shared["help"] if path in self._words.helps else ""
                shared["label"] = shared["label"] if adds or path in self._words.labels else ""
                return [Group(**shared, children=children, toggled=adds)]
            case "boolean":
                return [Flag(**shared, start=bool(default))]
            case "string":
                return [Text(**shared, most=schema.get("maxLength", 200))]
            case "array" if schema.get("maxItems") == 2 and schema.get("minItems") == 2:
                return [self._range(schema["items"], shared, unit, default, nullable)]
            case "array" if "enum" in self._resolved(schema["items"]):
                options = self._options(path, list(schema["items"]["enum"]))
                return [Several(**shared, options=options, start=tuple(default or ()))]
            case "array" if schema["items"].get("type") == "number":
                return [Numbers(**shared, unit=unit, nullable=nullable, toggled=adds)]
            case "array":
                return self._tables(self._resolved(schema["items"]), shared)
        whole = schema["type"] == "integer" or schema.get("multipleOf") == 1
        return [
            Number(
                **shared,
                unit=unit,
                allowed=allowed(schema, unit),
                nullable=nullable,
                whole=whole,
                start=default,
                slider=path in self._words.sliders,
                toggled=adds,
            )
        ]

    def _range(self, item: Schema, shared: dict[str, Any], unit: str, default: Any, nullable: bool) -> Node:
        ends = [
            Number(
                key=str(i),
                name=f"{shared['name']}.{i}",
                pointer=f"{shared['pointer']}/{i}",
                path=shared["path"],
                label=end % {"label": shared["label"]},
                unit=unit,
                allowed=allowed(item, unit),
            )
            for i, end in enumerate((_("%(label)s, least"), _("%(label)s, greatest")))
        ]
        return Range(**shared, low=ends[0], high=ends[1], start=default and tuple(default), toggled=nullable)

    def _union(self, schema: Schema, shared: dict[str, Any], prefix: str, path: str, unit: str) -> Node:
        members, key = [], shared["key"]
        tagged = [(model, *tag_of(model, item)) for item in schema["oneOf"] for model in [self._resolved(item)]]
        options = self._options(path, [tag for _, tag, _ in tagged])
        for model, tag, meant in tagged:
            only = {**shared, "name": f"{prefix}{key}.{tag}", "label": "", "help": "", "when": f"{prefix}{key}={tag}"}
            if model.get("type") == "object":
                children = self._children(model, f"{prefix}{key}.{tag}.", path, unit)
                part: Node = Group(**{**only, "help": _(first_sentence(model))}, children=children)
            else:
                named = {**only, "label": options[tag][:1].upper() + options[tag][1:]}
                part = self._plain(model, named, False, False, unit, None)[0]
            start = self._words.starts.get(path, {}).get(tag) or next(iter(model.get("examples", [])), None)
            members.append(Member(tag, meant, start, part))
        return Union(**shared, members=tuple(members), options=options)

    def _columns(self, properties: Mapping[str, Schema], keys: list[str]) -> tuple[Column, ...]:
        return tuple(Column(k, _(self._words.label(k)), split_unit(k)[1]) for k in keys)

    def _tables(self, item: Schema, shared: dict[str, Any]) -> list[Node]:
        properties = {n: self._resolved(s) for n, s in item["properties"].items()}
        if all(is_numbers(s) for s in properties.values()):
            columns = self._columns(properties, list(properties))
            return [Table(**shared, columns=columns, shape="groups", first=_(shared["key"].removesuffix("s")))]
        kinds = self._words.columns.get(shared["path"])
        if not kinds:
            return [Table(**shared, columns=self._columns(properties, list(properties)), shape="rows")]
        return [
            Table(
                **{**shared, "name": f"{shared['name']}.{variant}", "when": when},
                columns=self._columns(properties, list(keys)),
                shape="rows",
            )
            for variant, (keys, when) in kinds.items()
        ]

    def _table(self, name: str, parent: str, path: str, columns: tuple[Column, ...], shape: str, first: str) -> Node:
        pointer = "/" + parent.replace(".", "/") if parent else ""
        label = _(self._words.label(f"{parent}.points"))
        return Table(
            key="",
            name=name.rpartition(".")[0] + ".points",
            pointer=pointer,
            path=path,
            label=label,
            help=_("a line for each point: %(columns)s; paste from a spreadsheet")
            % {"columns": ", ".join(c.label for c in columns)},
            columns=columns,
            shape=shape,
            first=first,
        )

    def _options(self, path: str, values: list[str]) -> dict[str, str]:
        words = look_up(self._words.options, COMMON.options, path) or {}
        return {v: in_sentence(_(words.get(v, v.replace("_", " ") if v else "none"))) for v in values}
