"""Errors raised by the clients."""

from __future__ import annotations

from typing import Any


class Problem(Exception):
    """An error response (RFC 9457): ``status``, ``title``, ``detail``, and ``errors`` with one entry per invalid field:
    JSON ``pointer``, ``detail``, and the ``allowed`` values."""

    def __init__(self, body: dict[str, Any]) -> None:
        self.status: int = body.get("status", 0)
        self.title: str = body.get("title", "")
        self.detail: str = body.get("detail", "")
        self.errors: list[dict[str, str]] = body.get("errors", [])
        super().__init__(self._words())

    def _words(self) -> str:
        fields = "".join(f"\n  {e['pointer']}: {e['detail']} (allowed: {e['allowed']})" for e in self.errors)
        return f"{self.status} {self.title}: {self.detail}{fields}"


class RunFailed(Problem):
    """An accepted run ended without an answer; see ``run_id``."""

    def __init__(self, run_id: str, body: dict[str, Any]) -> None:
        self.run_id = run_id
        super().__init__(body)


class NoAnswer(Exception):
    """The service was unreachable or overloaded on every attempt, or waiting timed out."""
