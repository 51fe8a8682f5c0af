"""One walk over a report's blocks; a writer says how each of them is written in its format."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable

from app.reports.content import (
    Banner,
    Block,
    Bullets,
    Facts,
    Figure,
    Figures,
    Formula,
    Givens,
    Paragraph,
    Part,
    Report,
    Rows,
    Table,
)


class Writer(ABC):
    """A format of reports: a method for each sort of block."""

    def body(self, report: Report) -> str:
        """All blocks, those of a section under its heading."""
        return self.blocks(report.opening) + "".join(
            self.section(section.title, self.blocks(section.blocks)) for section in report.sections
        )

    def blocks(self, blocks: Iterable[Block]) -> str:
        return "".join(self._block(block) for block in blocks)

    def _block(self, block: Block) -> str:
        match block:
            case Banner():
                return self.banner(block)
            case Paragraph():
                return self.paragraph(block)
            case Bullets():
                return self.bullets(block)
            case Table():
                return self.table(block)
            case Facts():
                return self.facts(block)
            case Figure():
                return self.figure(block)
            case Figures():
                return self.figures(block)
            case Part():
                return self.part(block)
            case Givens():
                return self.givens(block)
            case Formula():
                return self.formula(block)
            case Rows():
                return self.rows(block)

    @abstractmethod
    def section(self, title: str, inside: str) -> str: ...

    @abstractmethod
    def banner(self, block: Banner) -> str: ...

    @abstractmethod
    def paragraph(self, block: Paragraph) -> str: ...

    @abstractmethod
    def bullets(self, block: Bullets) -> str: ...

    @abstractmethod
    def table(self, block: Table) -> str: ...

    @abstractmethod
    def facts(self, block: Facts) -> str: ...

    @abstractmethod
    def figure(self, block: Figure) -> str: ...

    @abstractmethod
    def figures(self, block: Figures) -> str: ...

    @abstractmethod
    def part(self, block: Part) -> str: ...

    @abstractmethod
    def givens(self, block: Givens) -> str: ...

    @abstractmethod
    def formula(self, block: Formula) -> str: ...

    @abstractmethod
    def rows(self, block: Rows) -> str: ...
