"""Form nodes: each converts its part of a request to texts and back.

Texts map input names to their contents as a browser sends them; an unticked checkbox is absent. ``take`` reads a
request object into texts, ``put`` writes texts into a request object.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from app.web.forms.numbers import number, shown
from app.words.languages import gettext as _

Texts = Mapping[str, str]
NO_VALUE = object()
"""Value of an empty non-nullable field, which is omitted from the request."""
_MAX_OPEN_OPTIONS = 3


def applies(when: str, texts: Texts) -> bool:
    """Evaluate a condition in the syntax of ``FormWords.when``; an empty one is true."""
    if not when:
        return True
    return any(
        all(texts.get(name, "") in values.split(",") for name, _, values in (c.partition("=") for c in way.split("&")))
        for way in when.split("|")
    )


@dataclass(frozen=True, kw_only=True)
class Node:
    """Base of all nodes: key in the request object, input name, JSON pointer, texts and visibility condition."""

    sort: ClassVar[str]
    key: str
    name: str
    pointer: str
    path: str
    label: str = ""
    help: str = ""
    when: str = ""
    toggled: bool = False
    """Whether a checkbox enables the node; if unticked, the request has null."""

    @property
    def hint(self) -> str:
        """The help text, if it adds to the label."""
        said = self.help.strip()
        return "" if said.lower() in self.label.lower() else said

    @property
    def box(self) -> str:
        """Name of the enabling checkbox."""
        return f"{self.name}.on"

    def present(self, texts: Texts) -> bool:
        return not self.toggled or texts.get(self.box) == "on"

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        if not applies(self.when, texts):
            return
        value = self.value(texts) if self.present(texts) else None
        if value is not NO_VALUE:
            into[self.key] = value

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        value = source.get(self.key, self.default)
        if self.toggled and value is not None:
            texts[self.box] = "on"
        self.show(value, texts)

    @property
    def default(self) -> Any:
        return None

    def value(self, texts: Texts) -> Any:
        raise NotImplementedError

    def show(self, value: Any, texts: dict[str, str]) -> None:
        raise NotImplementedError

    def parts(self, texts: Texts) -> Iterator[Node]:
        """This node and its descendants, if their conditions hold."""
        if applies(self.when, texts):
            yield self

    def every(self) -> Iterator[Node]:
        """This node and all descendants, regardless of conditions."""
        yield self

    def names(self) -> Iterator[str]:
        """Names of all inputs."""
        yield self.name
        if self.toggled:
            yield self.box

    def fault(self, pointer: str, words: str, texts: Texts) -> str:
        """The message of a fault at or below this node's pointer."""
        return words


@dataclass(frozen=True, kw_only=True)
class Number(Node):
    sort: ClassVar[str] = "number"
    unit: str = ""
    allowed: str = ""
    nullable: bool = False
    whole: bool = False
    start: float | None = None
    slider: bool = False

    @property
    def hint(self) -> str:
        """The allowed range and the help text."""
        return "; ".join(part for part in (self.allowed, super().hint) if part)

    @property
    def default(self) -> Any:
        return self.start

    def value(self, texts: Texts) -> Any:
        text = texts.get(self.name, "").strip()
        if not text:
            # An enabled field is required; a field with a default falls back to it.
            return None if self.nullable and not self.toggled else NO_VALUE
        found = number(text, self.unit)
        return int(found) if self.whole and isinstance(found, float) and found.is_integer() else found

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        super().put(into, texts)
        if self.toggled and self.present(texts) and applies(self.when, texts) and not texts.get(self.name, "").strip():
            into[self.key] = ""

    def show(self, value: Any, texts: dict[str, str]) -> None:
        texts[self.name] = shown(value, self.unit)

    def fault(self, pointer: str, words: str, texts: Texts) -> str:
        return _("is missing") if self.toggled and not texts.get(self.name, "").strip() else words


@dataclass(frozen=True, kw_only=True)
class Text(Node):
    sort: ClassVar[str] = "text"
    most: int = 200

    def value(self, texts: Texts) -> Any:
        return texts.get(self.name, "")

    def show(self, value: Any, texts: dict[str, str]) -> None:
        texts[self.name] = value or ""


@dataclass(frozen=True, kw_only=True)
class Flag(Node):
    sort: ClassVar[str] = "flag"
    start: bool = False

    @property
    def default(self) -> Any:
        return self.start

    def value(self, texts: Texts) -> Any:
        return texts.get(self.name) == "on"

    def show(self, value: Any, texts: dict[str, str]) -> None:
        if value:
            texts[self.name] = "on"


@dataclass(frozen=True, kw_only=True)
class Choice(Node):
    """One of several options; ``values`` are their request values. ``runs``: the options are stored runs."""

    sort: ClassVar[str] = "choice"
    options: Mapping[str, str]
    values: Mapping[str, Any]
    start: Any = None
    runs: bool = False

    @property
    def few(self) -> bool:
        """Whether the options are few enough to be shown at once."""
        return not self.runs and len(self.options) <= _MAX_OPEN_OPTIONS

    @property
    def default(self) -> Any:
        return self.start

    def value(self, texts: Texts) -> Any:
        text = texts.get(self.name, "")
        return self.values.get(text, text or None)

    def show(self, value: Any, texts: dict[str, str]) -> None:
        known = next((text for text, meant in self.values.items() if meant == value), None)
        texts[self.name] = shown(value) if known is None else known


@dataclass(frozen=True, kw_only=True)
class Switched(Choice):
    """A form-only choice on which the conditions of other nodes depend; absent from the request."""

    sort: ClassVar[str] = "union"
    of: Callable[[Mapping[str, Any]], str]

    @property
    def members(self) -> tuple[()]:
        return ()

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        pass

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        texts[self.name] = self.of(source)


@dataclass(frozen=True, kw_only=True)
class Several(Node):
    """Any number of options, one checkbox each."""

    sort: ClassVar[str] = "several"
    options: Mapping[str, str]
    start: tuple[str, ...] = ()

    @property
    def default(self) -> Any:
        return self.start

    def value(self, texts: Texts) -> Any:
        return [option for option in self.options if texts.get(f"{self.name}.{option}") == "on"]

    def show(self, value: Any, texts: dict[str, str]) -> None:
        for option in value or ():
            texts[f"{self.name}.{option}"] = "on"

    def names(self) -> Iterator[str]:
        for option in self.options:
            yield f"{self.name}.{option}"


@dataclass(frozen=True, kw_only=True)
class Effects(Node):
    """Selection of effects: one rule for all, or per effect include, exclude or automatic."""

    sort: ClassVar[str] = "effects"
    options: Mapping[str, str]
    known: Mapping[str, str]

    @property
    def default(self) -> Any:
        return "auto"

    def value(self, texts: Texts) -> Any:
        rule = texts.get(self.name, "auto")
        if rule != "choice":
            return rule
        chosen = {name: texts.get(f"{self.name}.{name}", "") for name in self.known}
        return {will: [name for name, said in chosen.items() if said == will] for will in ("include", "exclude")}

    def show(self, value: Any, texts: dict[str, str]) -> None:
        texts[self.name] = "choice" if isinstance(value, dict) else value
        if isinstance(value, dict):
            for will in ("include", "exclude"):
                texts.update({f"{self.name}.{name}": will for name in value.get(will, ())})

    def names(self) -> Iterator[str]:
        yield self.name
        for name in self.known:
            yield f"{self.name}.{name}"


@dataclass(frozen=True, kw_only=True)
class Constant(Node):
    """Constant discriminator of a union member."""

    sort: ClassVar[str] = "constant"
    constant: Any

    def value(self, texts: Texts) -> Any:
        return self.constant

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        pass

    def names(self) -> Iterator[str]:
        return iter(())
