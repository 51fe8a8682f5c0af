"""Results, verdict and tables of a run for a spreadsheet, which runs nothing of it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from typing import Any

from app.designs.kind import Kind
from app.designs.units import split_unit
from app.exports.export import Export, Run, Wishes
from app.exports.text import cell

_ABOUT = ("id", "kind", "mode", "status", "name", "created_at", "spec_hash")


def make(_kind: Kind, run: Run, _wishes: Wishes) -> bytes:
    """One block of `field,value,unit`, then a block for each table, with an empty line between."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")

    def row(*cells: object) -> None:
        writer.writerow([cell(each) for each in cells])

    row("field", "value", "unit")
    for name in _ABOUT:
        row(f"run.{name}", run.get(name), "")
    row("run.solver", f"{run['solver']['name']} {run['solver']['version']}", "")
    tables: dict[str, list[Mapping[str, Any]]] = {}
    for part in ("verdict", "spec", "result", "accuracy"):
        for name, value in _leaves(part, run.get(part), tables):
            row(name, value, split_unit(name.rpartition(".")[2])[1])
    if run.get("effects"):
        tables["effects"] = run["effects"]
    for name, rows in tables.items():
        head = list(dict.fromkeys(key for each in rows for key in each))
        writer.writerow([])
        row(name)
        row(*head)
        for each in rows:
            row(*(_flat(each.get(key)) for key in head))
    # Spreadsheets take a file for UTF-8 by its mark.
    return b"\xef\xbb\xbf" + out.getvalue().encode("utf-8", "replace")


def _leaves(name: str, value: Any, tables: dict[str, list[Mapping[str, Any]]]) -> Iterator[tuple[str, Any]]:
    """(dotted name, value) of every single value; lists of objects go to the tables."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _leaves(f"{name}.{key}", inner, tables)
    elif isinstance(value, list):
        if value and all(isinstance(item, Mapping) for item in value):
            tables[name] = value
        elif value and all(isinstance(item, (int, float)) for item in value) and len(value) > 4:
            tables.setdefault(name, [{name.rpartition(".")[2]: item} for item in value])
        else:
            for number, item in enumerate(value):
                yield from _leaves(f"{name}.{number}", item, tables)
    else:
        yield name, value


def _flat(value: Any) -> Any:
    """A value within a table's row; one of several parts as text."""
    if isinstance(value, Mapping):
        return "; ".join(f"{key} {_flat(inner)}" for key, inner in value.items())
    if isinstance(value, list):
        return "; ".join(str(_flat(item)) for item in value)
    return value


CSV = Export("csv", "CSV: results and tables for a spreadsheet", "text/csv", "csv", make)
