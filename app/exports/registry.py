"""The only list of exports. Importing it brings no library that a format needs: those come when a file is made."""

from __future__ import annotations

from app.designs.registry import KINDS
from app.exports.export import Export, Run
from app.exports.run_json import JSON

EXPORTS: dict[str, Export] = {export.name: export for export in (JSON,)}


def exports_for(run: Run) -> dict[str, Export]:
    """The exports of a run with a result; none of one without, or of a kind that is no more."""
    kind = KINDS.get(run["kind"])
    if kind is None or run.get("result") is None:
        return {}
    return {name: export for name, export in EXPORTS.items() if export.applies(kind, run)}
