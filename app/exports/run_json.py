"""JSON export of a run, as in the API."""

from __future__ import annotations

import json

from app.designs.kind import Kind
from app.exports.export import Export, ExportOptions, ExportProcess, Run


def make(_kind: Kind, run: Run, _options: ExportOptions) -> bytes:
    """The run as indented JSON."""
    return json.dumps(run, indent=2, ensure_ascii=False).encode() + b"\n"


JSON = Export(
    "json", "JSON: everything that is known of the run", "application/json", "json", make, where=ExportProcess.SERVICE
)
