"""HTML and PDF reports of a run: verdict, hand calculation, certificate."""

from __future__ import annotations

from datetime import datetime

from app.designs.kind import Kind
from app.exports.export import Export, ExportOptions, Run
from app.words.languages import speaking


def make_html(_kind: Kind, run: Run, options: ExportOptions) -> bytes:
    """A self-contained HTML file."""
    from app.reports.build import report_of
    from app.reports.html import html

    with speaking(options.language):
        return html(report_of(run)).encode()


def make_pdf(_kind: Kind, run: Run, options: ExportOptions) -> bytes:
    """The report as PDF, with the request attached."""
    from app.reports.build import report_of
    from app.reports.pdf import pdf

    with speaking(options.language):
        return pdf(report_of(run), datetime.fromisoformat(run["created_at"]))


HTML = Export("html", "HTML: the report, with the calculation by hand", "text/html; charset=utf-8", "html", make_html)
PDF = Export(
    "pdf", "PDF: the same report to print, its request attached", "application/pdf", "pdf", make_pdf, module="typst"
)
