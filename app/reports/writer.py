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
        match block:
            case content.Banner():
                return self.banner(block)
            case content.Paragraph():
                return self.paragraph(block)
            case content.Bullets():
                return self.bullets(block)
            case content.Table():
                return self.table(block)
            case content.Facts():
                return self.facts(block)
            case content.Figure():
                return self.figure(block)
            case content.Figures():
                return self.figures(block)
            case content.Part():
                return self.part(block)
            case content.Givens():
                return self.givens(block)
            case content.Formula():
                return self.formula(block)
            case content.Rows():
                return self.rows(block)

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
