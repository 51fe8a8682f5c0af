"""Registry of exports. Importing it imports no format's libraries; those are imported when a file is made."""

from __future__ import annotations

from app.designs.registry import KINDS
from app.exports.csv_file import CSV
from app.exports.dxf import DXF
from app.exports.export import Export, ExportProcess, Run
from app.exports.parameters import PARAMETERS
from app.exports.report import HTML, PDF
from app.exports.run_json import JSON
from app.exports.step import STEP
from app.exports.svg import SVG

EXPORTS: dict[str, Export] = {export.name: export for export in (HTML, PDF, JSON, CSV, SVG, DXF, STEP, PARAMETERS)}

_CONDITIONS = frozenset(export.applies for export in EXPORTS.values())


def worker_libraries() -> list[str]:
    """The libraries of the formats that workers make, as far as they are installed."""
    exports = (export for export in EXPORTS.values() if export.where is ExportProcess.WORKER)
    return [export.module for export in exports if export.module and not export.missing]


def exports_for(run: Run) -> dict[str, Export]:
    """The exports that apply to a run; none without a result or for an unknown kind."""
    kind = KINDS.get(run["kind"])
    if kind is None or run.get("result") is None:
        return {}
    met = {condition for condition in _CONDITIONS if condition(kind, run)}
    return {name: export for name, export in EXPORTS.items() if export.applies in met}
