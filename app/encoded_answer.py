"""Answers as they leave a worker: encoded there, and never decoded on the way to the store and the client."""

from __future__ import annotations

from typing import Any, NamedTuple, Self

from pydantic_core import from_json, to_json

from app.designs.kind import Answer, Mode
from app.designs.registry import KINDS, plots_for
from app.designs.schema import finite
from app.exports.registry import exports_for

_PARTS = ("result", "problem", "effects", "accuracy", "verdict")


class EncodedAnswer(NamedTuple):
    """An answer whose ``parts`` are JSON exactly as stored and returned, with the facts that the service needs.

    ``holds`` is the verdict's, ``figure`` the headline number of the result and ``figure_name`` its name; ``plots`` and
    ``exports`` are the names of those offered, ``effects`` the name and the state of each effect. ``finite`` is false
    for an answer that JSON cannot represent.
    """

    status: str
    parts: dict[str, bytes | None]
    timing: dict[str, float]
    holds: bool | None
    figure_name: str | None
    figure: float | None
    plots: tuple[str, ...]
    exports: tuple[str, ...]
    effects: tuple[tuple[str, str], ...]
    finite: bool

    @classmethod
    def of(cls, kind_slug: str, mode: str, answer: Answer) -> Self:
        """Encode the answer to a request of this kind and mode."""
        parts = {name: None if (value := getattr(answer, name)) is None else to_json(value) for name in _PARTS}
        name, figure = None, None
        if answer.status == "succeeded" and answer.result is not None:
            name, figure = KINDS[kind_slug].headline(Mode(mode), answer.result)
        plots, exports = offered(kind_slug, mode, answer.status, answer.result)
        return cls(
            status=answer.status,
            parts=parts,
            timing=answer.timing,
            holds=None if answer.verdict is None else answer.verdict["holds"],
            figure_name=None if figure is None else name,
            figure=None if figure is None else float(figure),
            plots=plots,
            exports=exports,
            effects=tuple((effect["name"], effect["state"]) for effect in answer.effects),
            finite=all(_finite(text, getattr(answer, name)) for name, text in parts.items()),
        )

    def decoded(self) -> Answer:
        """The answer as objects."""
        parts = {name: None if text is None else from_json(text) for name, text in self.parts.items()}
        return Answer(status=self.status, timing=self.timing, **parts)


def offered(
    slug: str, mode: str, status: str, result: dict[str, Any] | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the plots and exports of a run."""
    kind, shown = KINDS.get(slug), {"kind": slug, "mode": mode, "status": status, "result": result}
    drawn = kind is not None and status == "succeeded" and result is not None
    return tuple(plots_for(kind, shown) if drawn else ()), tuple(exports_for(shown))


def _finite(text: bytes | None, value: Any) -> bool:
    """Whether a value, and hence its JSON, has only finite numbers; the words NaN and Infinity may also occur in a
    text.

    A letter is found thirty times as fast as a word, and long results contain hardly any.
    """
    if text is None or not ((b"N" in text and b"NaN" in text) or (b"I" in text and b"Infinity" in text)):
        return True
    return finite(value)
