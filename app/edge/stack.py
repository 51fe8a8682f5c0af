"""The edge as one: what a request passes from the outside in."""

from __future__ import annotations

from collections.abc import Callable

from fastapi import FastAPI

from app.edge.answers import GuardedAnswers
from app.edge.asgi import Application
from app.edge.bodies import BodyLimits, BoundedBodies
from app.edge.crowds import BoundedCrowds
from app.edge.heads import BoundedHeads
from app.edge.hosts import KnownHosts, is_address
from app.edge.requests import LoggedRequests
from app.settings import Settings

BATCHES = "/api/v1/batches"
UPLOADS = "/batches/upload"
"""Paths whose bodies may be larger."""


def edge(
    inner: Application,
    settings: Settings,
    stopping: Callable[[], bool],
    known: Callable[[Application], Application] = lambda inner: inner,
) -> Application:
    """The application behind all that guards it; ``known`` sets before it who finds out who calls."""
    names = [name.strip() for name in settings.allowed_hosts.split(",") if name.strip()]
    limits = BodyLimits(
        settings.max_body_bytes,
        {BATCHES: settings.max_batch_bytes, UPLOADS: settings.max_upload_bytes},
        settings.body_idle_s,
        settings.body_grace_s,
        settings.body_least_bytes_per_s,
    )
    guarded: Application = known(BoundedBodies(inner, limits, stopping))
    guarded = BoundedCrowds(guarded, settings.max_requests)
    guarded = KnownHosts(guarded, names if is_address(settings.host) else [*names, settings.host])
    guarded = BoundedHeads(guarded, settings.max_head_bytes, settings.max_headers)
    return LoggedRequests(GuardedAnswers(guarded))


class GuardedFastAPI(FastAPI):
    """An application whose very answers to its own failures pass the edge too."""

    guard: Callable[[Application], Application] | None = None

    def build_middleware_stack(self) -> Application:  # type: ignore[override]
        inner = super().build_middleware_stack()
        return inner if self.guard is None else self.guard(inner)
