"""A run."""

from __future__ import annotations

from typing import Any, cast

from crankwright_client.types import AccuracyResult, EffectResult, Links, RunProgress, VerdictResult

OPEN = frozenset({"queued", "running"})


class Run:
    """A run: ``json`` is the complete response, the properties its main parts."""

    def __init__(self, json: dict[str, Any]) -> None:
        self.json = json

    @property
    def id(self) -> str:
        return self.json["id"]

    @property
    def kind(self) -> str:
        return self.json["kind"]

    @property
    def mode(self) -> str:
        return self.json["mode"]

    @property
    def status(self) -> str:
        """State: queued, running, succeeded, infeasible, failed or cancelled."""
        return self.json["status"]

    @property
    def ended(self) -> bool:
        return self.status not in OPEN

    @property
    def holds(self) -> bool | None:
        """Whether the part holds; None without a verdict."""
        return self.json["holds"]

    @property
    def verdict(self) -> VerdictResult | None:
        return self.json["verdict"]

    @property
    def spec(self) -> dict[str, Any]:
        """The validated request with defaults filled in."""
        return self.json["spec"]

    @property
    def result(self) -> dict[str, Any]:
        """The result, or the diagnosis of an infeasible design; empty if there is none."""
        return self.json["result"] or {}

    @property
    def effects(self) -> list[EffectResult]:
        return self.json["effects"]

    @property
    def accuracy(self) -> AccuracyResult | None:
        return self.json["accuracy"]

    @property
    def progress(self) -> RunProgress | None:
        return self.json["progress"]

    @property
    def links(self) -> Links:
        return cast(Links, self.json["links"])

    def __repr__(self) -> str:
        return f"<Run {self.id} {self.kind} {self.mode}: {self.status}, holds {self.holds}>"
