"""What a key may be good for, and what each request needs."""

from __future__ import annotations

from enum import StrEnum


class Scope(StrEnum):
    """``read`` sees one's own runs, ``design`` solves too, ``batch`` sends batches too, ``admin`` sees everybody's runs
    and the metrics, and may all of it."""

    READ = "read"
    DESIGN = "design"
    BATCH = "batch"
    ADMIN = "admin"


_MEANT_TOO = {
    Scope.READ: {Scope.READ},
    Scope.DESIGN: {Scope.READ, Scope.DESIGN},
    Scope.BATCH: {Scope.READ, Scope.BATCH},
    Scope.ADMIN: set(Scope),
}

PUBLIC = ("/healthz", "/startedz", "/readyz", "/login", "/favicon.ico")
"""Paths that need no key, besides the files of the pages and the choice of their language."""
_OF_OPERATORS = ("/metrics",)
_OF_BATCHES = ("/api/v1/batches", "/batches")
_SAFE = ("GET", "HEAD", "OPTIONS")


def granted(scopes: str) -> frozenset[Scope]:
    """All that a key's words give."""
    return frozenset().union(*(_MEANT_TOO[Scope(word)] for word in scopes.split()))


def needed(method: str, path: str) -> Scope | None:
    """The scope that a request needs; None where it needs no key.

    What is not named here is read with ``read`` and changed with ``design``, so no route is ever open by omission.
    """
    if path in PUBLIC or path.startswith(("/static/", "/language/")):
        return None
    if path in _OF_OPERATORS:
        return Scope.ADMIN
    if method in _SAFE or path == "/logout":
        return Scope.READ
    return Scope.BATCH if any(path == start or path.startswith(f"{start}/") for start in _OF_BATCHES) else Scope.DESIGN
