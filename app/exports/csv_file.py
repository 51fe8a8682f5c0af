"""CSV export of results, verdict and tables, protected against formula injection."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from typing import Any

from app.designs.kind import Kind
from app.designs.units import split_unit
from app.exports.export import Export, ExportOptions, Run
from app.exports.text import cell

_ABOUT = ("id", "kind", "mode", "status", "name", "created_at", "spec_hash")


def make(_kind: Kind, run: Run, _options: ExportOptions) -> bytes:
    """A block of `field,value,unit`, then one block per table, separated by empty lines."""
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
            row(name, value, _unit(name))
    if run.get("effects"):
        tables["effects"] = run["effects"]
    for name, rows in tables.items():
        head = list(dict.fromkeys(key for each in rows for key in each))
        writer.writerow([])
        row(name)
        row(*head)
        for each in rows:
            row(*(_flat(each.get(key)) for key in head))
    # The byte-order mark makes spreadsheets read the file as UTF-8.
    return b"\xef\xbb\xbf" + out.getvalue().encode("utf-8", "replace")


def _unit(name: str) -> str:
    """The unit of a dotted name: its own, or that of the array or the table of names it stands in."""
    return next((unit for step in reversed(name.split(".")) if (unit := split_unit(step)[1])), "")


def _leaves(name: str, value: Any, tables: dict[str, list[Mapping[str, Any]]]) -> Iterator[tuple[str, Any]]:
    """Yield (dotted name, value) of every scalar; lists of objects are collected in ``tables``."""
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
    """Flatten a value into one table cell."""
    if isinstance(value, Mapping):
        return "; ".join(f"{key} {_flat(inner)}" for key, inner in value.items())
    if isinstance(value, list):
        return "; ".join(str(_flat(item)) for item in value)
    return value


CSV = Export("csv", "CSV: results and tables for a spreadsheet", "text/csv", "csv", make)
