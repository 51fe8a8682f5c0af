"""The part's parameters in the import format of each CAD program; names as in the API, lengths in mm."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Sequence

from app.designs.kind import Kind
from app.designs.part import Parameter
from app.exports.export import Export, ExportOptions, File, Run, Tool, has_part
from app.exports.text import cell, plain, word
from app.exports.xlsx import workbook

_XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"


def make(kind: Kind, run: Run, options: ExportOptions) -> File:
    """The parameters for the requested program."""
    return _WRITERS[options.tool](kind.part(run, options.angle_deg).parameters)


def _number(value: float) -> str:
    """13 digits, so that 21.99 - 2*2.5 is 16.99, without an exponent, which not every program can read."""
    text = repr(float(f"{value:.13g}"))
    if "e" in text:
        text = f"{value:.17f}".rstrip("0") if abs(value) < 1.0 else f"{value:.0f}"
    return text.removesuffix(".").removesuffix(".0")


def _table(rows: Sequence[Sequence[str]], delimiter: str = ",") -> bytes:
    out = io.StringIO()
    csv.writer(out, delimiter=delimiter, lineterminator="\r\n").writerows(rows)
    return out.getvalue().encode()


def _fusion(parameters: Sequence[Parameter]) -> File:
    """Fusion: Modify > Change Parameters > Import; the columns of its own export."""
    rows = [["Name", "Unit", "Expression", "Value", "Comments", "Favorite"]]
    for p in parameters:
        text = f"{_number(p.value)} {p.unit}".strip()
        rows.append([word(p.name), p.unit, text, _number(p.value), cell(plain(p.comment)), "true"])
    return File(_table(rows), "text/csv", "csv")


def _freecad(parameters: Sequence[Parameter]) -> File:
    """FreeCAD: Spreadsheet workbench > Import; name, quantity and comment, separated by tabs."""
    rows = [[word(p.name), f"={_number(p.value)} {p.unit}".rstrip(), plain(p.comment)] for p in parameters]
    return File(_table(rows, "\t"), "text/csv", "csv")


def _onshape(parameters: Sequence[Parameter]) -> File:
    """Onshape: body of the API call that sets the variables of a variable studio."""
    types = {"mm": "LENGTH", "deg": "ANGLE"}
    text = [
        {
            "name": word(p.name),
            "type": types.get(p.unit, "NUMBER"),
            "expression": f"{_number(p.value)} {p.unit}".strip(),
            "description": plain(p.comment),
        }
        for p in parameters
    ]
    return File(json.dumps(text, indent=2).encode() + b"\n", "application/json", "json")


def _solidworks(parameters: Sequence[Parameter]) -> File:
    """SolidWorks: Tools > Equations > Import; global variables."""
    lines = [f'"{word(p.name)}"= {_number(p.value)}{p.unit}' for p in parameters]
    # The byte-order mark identifies UTF-8; line ends are those of Windows.
    return File(("\r\n".join(lines) + "\r\n").encode("utf-8-sig"), "text/plain; charset=utf-8", "txt")


def _inventor(parameters: Sequence[Parameter]) -> File:
    """Inventor: Manage > Parameters > Link; name, value, unit and comment in columns A to D."""
    rows = [[word(p.name), float(_number(p.value)), p.unit or "ul", plain(p.comment)] for p in parameters]
    return File(workbook("parameters", rows), _XLSX, "xlsx")


_WRITERS: dict[Tool, Callable[[Sequence[Parameter]], File]] = {
    Tool.FREECAD: _freecad,
    Tool.FUSION: _fusion,
    Tool.ONSHAPE: _onshape,
    Tool.SOLIDWORKS: _solidworks,
    Tool.INVENTOR: _inventor,
}

PARAMETERS = Export(
    "parameters", "Parameters: names and values to drive a model", "text/plain", "txt", make, has_part,
    other_media_types=("text/csv", "application/json", _XLSX),
)  # fmt: skip
