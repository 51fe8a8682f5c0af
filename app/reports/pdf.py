"""A report as PDF, by typst: its compiler is in the package, its fonts too, and it asks nobody else."""

from __future__ import annotations

import tempfile
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any

from app.reports.content import Report
from app.reports.typst_source import typst_source


@cache
def _fonts() -> Any:
    import typst

    return typst.Fonts(include_system_fonts=False)


def pdf(report: Report, made: datetime) -> bytes:
    """The document; the same report gives the same bytes.

    It runs in the process that calls it, which cannot be interrupted meanwhile: call it from a worker.
    """
    import typst

    # A folder without files as the root: the source cannot read anything, whatever it says.
    with tempfile.TemporaryDirectory() as empty:
        compiler = typst.Compiler(typst_source(report).encode(), root=Path(empty), font_paths=_fonts())
        return compiler.compile(format="pdf", timestamp=made.replace(microsecond=0))
