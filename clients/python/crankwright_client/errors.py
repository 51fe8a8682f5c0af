"""What may go wrong between a client and the service."""

from __future__ import annotations

from typing import Any


class Problem(Exception):
    """The service's refusal (RFC 9457): ``status``, ``title``, ``detail``, and ``errors`` with one entry per bad field,
    each with its JSON ``pointer``, what is wrong (``detail``) and what is ``allowed``."""

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
    """A run that was accepted and ended without an answer; ``run_id`` names it."""

    def __init__(self, run_id: str, body: dict[str, Any]) -> None:
        self.run_id = run_id
        super().__init__(body)


class NoAnswer(Exception):
    """The service could not be reached, or had too much to do, as often as was tried, or a wait was too short."""
