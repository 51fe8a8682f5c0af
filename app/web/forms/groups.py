"""Composite form nodes: ranges, objects, unions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from app.web.forms.nodes import NO_VALUE, Node, Number, Texts, applies


@dataclass(frozen=True, kw_only=True)
class Range(Node):
    """Lower and upper bound."""

    sort: ClassVar[str] = "range"
    low: Number
    high: Number
    start: tuple[float, ...] | None = None

    @property
    def hint(self) -> str:
        return "; ".join(part for part in (self.low.allowed, super().hint) if part)

    @property
    def default(self) -> Any:
        return self.start

    def value(self, texts: Texts) -> Any:
        ends = [end.value(texts) for end in (self.low, self.high)]
        return [None if end is NO_VALUE else end for end in ends]

    def show(self, value: Any, texts: dict[str, str]) -> None:
        for end, part in zip((self.low, self.high), value or (None, None), strict=False):
            end.show(part, texts)

    def parts(self, texts: Texts) -> Iterator[Node]:
        if applies(self.when, texts):
            yield from (self, self.low, self.high)

    def names(self) -> Iterator[str]:
        yield from (self.low.name, self.high.name)
        if self.toggled:
            yield self.box


@dataclass(frozen=True, kw_only=True)
class Group(Node):
    """Fields of an object; without a key, a mere heading for fields of the enclosing object."""

    sort: ClassVar[str] = "group"
    children: tuple[Node, ...]
    closed: bool = False

    def value(self, texts: Texts) -> Any:
        inner: dict[str, Any] = {}
        for child in self.children:
            child.put(inner, texts)
        return inner

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        if self.key:
            super().put(into, texts)
        elif applies(self.when, texts):
            for child in self.children:
                child.put(into, texts)

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        inner = source.get(self.key) if self.key else source
        if self.toggled and _filled(inner):
            texts[self.box] = "on"
        for child in self.children:
            child.take(inner if isinstance(inner, Mapping) else {}, texts)

    def parts(self, texts: Texts) -> Iterator[Node]:
        if applies(self.when, texts):
            yield self
            if self.present(texts):
                for child in self.children:
                    yield from child.parts(texts)

    def every(self) -> Iterator[Node]:
        yield self
        for child in self.children:
            yield from child.every()

    def names(self) -> Iterator[str]:
        if self.toggled:
            yield self.box
        for child in self.children:
            yield from child.names()


def _filled(value: Any) -> bool:
    return any(item is not None for item in value.values()) if isinstance(value, Mapping) else value is not None


@dataclass(frozen=True)
class Member:
    """A member of a union: tag, predicate on values (``meant``), initial value and form node."""

    tag: str
    meant: Callable[[Any], bool]
    start: Any
    part: Node


@dataclass(frozen=True, kw_only=True)
class Union(Node):
    """A tagged union: all members are rendered, only the selected one is shown and submitted.

    Without a key the members are alternatives of the whole request.
    """

    sort: ClassVar[str] = "union"
    members: tuple[Member, ...]
    options: Mapping[str, str]

    def chosen(self, texts: Texts) -> Member:
        tag = texts.get(self.name)
        return next((member for member in self.members if member.tag == tag), self.members[0])

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        if applies(self.when, texts):
            self.chosen(texts).part.put(into, texts)

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        value = source.get(self.key) if self.key else source
        meant = next((member for member in self.members if member.meant(value)), self.members[0])
        texts[self.name] = meant.tag
        for member in self.members:
            given = value if member is meant else member.start
            member.part.take({self.key: given} if self.key else given or {}, texts)

    def parts(self, texts: Texts) -> Iterator[Node]:
        if applies(self.when, texts):
            yield self
            yield from self.chosen(texts).part.parts(texts)

    def every(self) -> Iterator[Node]:
        yield self
        for member in self.members:
            yield from member.part.every()

    def names(self) -> Iterator[str]:
        yield self.name
        for member in self.members:
            yield from member.part.names()
