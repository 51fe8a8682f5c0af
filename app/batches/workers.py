"""Processes that solve only chunks of batches: those of a machine in a cluster."""

from __future__ import annotations

from app.batches import chunk
from app.jobs.executor import PoolSettings
from app.settings import Settings


def chunk_workers(settings: Settings) -> PoolSettings:
    """A pool of ``settings.batch_workers`` processes for chunks, and none for interactive requests."""
    return PoolSettings(
        workers=0,
        memory_bytes=settings.solve_memory_bytes,
        background_workers=settings.batch_workers,
        background_entry=chunk.answer,
        background_niceness=settings.batch_niceness,
    )
