"""The part's parameters in the form that each CAD program imports; names are those of the contract, lengths in mm."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Sequence

from app.designs.kind import Kind
from app.designs.part import Parameter
from app.exports.export import Export, File, Refusal, Run, Tool, Wishes, of_a_part
from app.exports.parts import part_of
from app.exports.text import cell, plain, word
from app.exports.xlsx import workbook

_XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"


def make(kind: Kind, run: Run, wishes: Wishes) -> File | Refusal:
    """The table for the program asked for."""
    part = part_of(kind, run, wishes)
    return part if isinstance(part, Refusal) else _WRITERS[wishes.tool](part.parameters)


def _number(value: float) -> str:
    """All digits, without an exponent, which not every program reads."""
    told = repr(float(value))
    if "e" in told:
        told = f"{value:.17f}".rstrip("0") if abs(value) < 1.0 else f"{value:.0f}"
    return told.removesuffix(".").removesuffix(".0")


def _table(rows: Sequence[Sequence[str]], delimiter: str = ",") -> bytes:
    out = io.StringIO()
    csv.writer(out, delimiter=delimiter, lineterminator="\r\n").writerows(rows)
    return out.getvalue().encode()


def _fusion(parameters: Sequence[Parameter]) -> File:
    """Modify, Change Parameters, Import Parameters: the columns that its own export writes."""
    rows = [["Name", "Unit", "Expression", "Value", "Comments", "Favorite"]]
    for p in parameters:
        told = f"{_number(p.value)} {p.unit}".strip()
        rows.append([word(p.name), p.unit, told, _number(p.value), cell(plain(p.comment)), "true"])
    return File(_table(rows), "text/csv", "csv")


def _freecad(parameters: Sequence[Parameter]) -> File:
    """Spreadsheet workbench, Import: a name, a quantity and a comment in each row, with tabs between."""
    rows = [[word(p.name), f"={_number(p.value)} {p.unit}".rstrip(), plain(p.comment)] for p in parameters]
    return File(_table(rows, "\t"), "text/csv", "csv")


def _onshape(parameters: Sequence[Parameter]) -> File:
    """The body of its call that sets the variables of a variable studio."""
    types = {"mm": "LENGTH", "deg": "ANGLE"}
    told = [
        {
            "name": word(p.name),
            "type": types.get(p.unit, "NUMBER"),
            "expression": f"{_number(p.value)} {p.unit}".strip(),
            "description": plain(p.comment),
        }
        for p in parameters
    ]
    return File(json.dumps(told, indent=2).encode() + b"\n", "application/json", "json")


def _solidworks(parameters: Sequence[Parameter]) -> File:
    """Tools, Equations, Import: global variables."""
    lines = [f'"{word(p.name)}"= {_number(p.value)}{p.unit}' for p in parameters]
    # A mark tells its import that the file is UTF-8; line ends are those of its system.
    return File(("\r\n".join(lines) + "\r\n").encode("utf-8-sig"), "text/plain; charset=utf-8", "txt")


def _inventor(parameters: Sequence[Parameter]) -> File:
    """Manage, Parameters, Link: a workbook with name, value, unit and comment in the columns A to D."""
    rows = [[word(p.name), float(p.value), p.unit or "ul", plain(p.comment)] for p in parameters]
    return File(workbook("parameters", rows), _XLSX, "xlsx")


_WRITERS: dict[Tool, Callable[[Sequence[Parameter]], File]] = {
    Tool.FREECAD: _freecad,
    Tool.FUSION: _fusion,
    Tool.ONSHAPE: _onshape,
    Tool.SOLIDWORKS: _solidworks,
    Tool.INVENTOR: _inventor,
}

PARAMETERS = Export(
    "parameters", "Parameters: names and values to drive a model", "text/plain", "txt", make, of_a_part,
    other_media_types=("text/csv", "application/json", _XLSX),
)  # fmt: skip
