"""Scopes of keys, and the scope each request needs."""

from __future__ import annotations

from enum import StrEnum


class Scope(StrEnum):
    """``read``: see one's own runs; ``design``: also solve; ``batch``: also submit batches; ``admin``: everything,
    including other callers' runs and the metrics."""

    READ = "read"
    DESIGN = "design"
    BATCH = "batch"
    ADMIN = "admin"


_IMPLIED = {
    Scope.READ: {Scope.READ},
    Scope.DESIGN: {Scope.READ, Scope.DESIGN},
    Scope.BATCH: {Scope.READ, Scope.BATCH},
    Scope.ADMIN: set(Scope),
}

PUBLIC = ("/healthz", "/startedz", "/readyz", "/login", "/favicon.ico")
"""Paths that need no key, in addition to static files and the choice of language."""
_ADMIN_PATHS = ("/metrics",)
_BATCH_PATHS = ("/api/v1/batches", "/batches")
_BELOW_BATCHES = tuple(f"{path}/" for path in _BATCH_PATHS)
_SAFE = ("GET", "HEAD", "OPTIONS")


def granted(scopes: str) -> frozenset[Scope]:
    """All scopes implied by a key's scopes."""
    return frozenset().union(*(_IMPLIED[Scope(word)] for word in scopes.split()))


def needed(method: str, path: str) -> Scope | None:
    """The scope that a request needs; None if it needs no key.

    Any path not listed here needs ``read`` for safe methods and ``design`` for others, so no route is open by omission.
    """
    if path in PUBLIC or path.startswith(("/static/", "/language/")):
        return None
    if path in _ADMIN_PATHS:
        return Scope.ADMIN
    if method in _SAFE or path == "/logout":
        return Scope.READ
    return Scope.BATCH if path in _BATCH_PATHS or path.startswith(_BELOW_BATCHES) else Scope.DESIGN
