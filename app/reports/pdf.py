"""A report as PDF, compiled offline by typst with its bundled fonts."""

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
    """The PDF document; deterministic for equal reports.

    Compiles in the calling process without interruption: call it from a worker.
    """
    import typst

    # Sandbox: an empty root directory, so that the source cannot read any file.
    with tempfile.TemporaryDirectory() as empty:
        compiler = typst.Compiler(typst_source(report).encode(), root=Path(empty), font_paths=_fonts())
        return compiler.compile(format="pdf", timestamp=made.replace(microsecond=0))
