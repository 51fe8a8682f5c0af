"""Traversal of a report's blocks, common to all output formats."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable

from app.reports import content


class Writer(ABC):
    """An output format of reports, with one method per block type."""

    def body(self, report: content.Report) -> str:
        """All blocks, grouped in sections."""
        return self.blocks(report.opening) + "".join(
            self.section(section.title, self.blocks(section.blocks)) for section in report.sections
        )

    def blocks(self, blocks: Iterable[content.Block]) -> str:
        return "".join(self._block(block) for block in blocks)

    def _block(self, block: content.Block) -> str:
        """A block by the method named after its type."""
        return getattr(self, type(block).__name__.lower())(block)

    @abstractmethod
    def section(self, title: str, inside: str) -> str: ...

    @abstractmethod
    def banner(self, block: content.Banner) -> str: ...

    @abstractmethod
    def paragraph(self, block: content.Paragraph) -> str: ...

    @abstractmethod
    def bullets(self, block: content.Bullets) -> str: ...

    @abstractmethod
    def table(self, block: content.Table) -> str: ...

    @abstractmethod
    def facts(self, block: content.Facts) -> str: ...

    @abstractmethod
    def figure(self, block: content.Figure) -> str: ...

    @abstractmethod
    def figures(self, block: content.Figures) -> str: ...

    @abstractmethod
    def part(self, block: content.Part) -> str: ...

    @abstractmethod
    def givens(self, block: content.Givens) -> str: ...

    @abstractmethod
    def formula(self, block: content.Formula) -> str: ...

    @abstractmethod
    def rows(self, block: content.Rows) -> str: ...
