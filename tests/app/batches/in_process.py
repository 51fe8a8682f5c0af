"""An executor that solves in this process: no worker has to start."""

from __future__ import annotations

import asyncio
import json
from typing import Any

from app.batches import chunk
from app.batches.task import Needs, Solved
from app.designs.progress import ignore_progress
from app.jobs import calls


class InProcess:
    """In place of a ProcessPool, for solves that neither fail nor overrun; knows what ``run`` was asked to solve."""

    background_workers = 1

    def __init__(self, *_settings: Any) -> None:
        self.asked: list[dict[str, Any]] = []

    def start(self) -> None: ...

    def close(self) -> None: ...

    async def run(self, kind: str, mode: str, payload: bytes, _budget_s: float) -> Any:
        self.asked.append(json.loads(payload))
        return calls.answer(kind, mode, payload, ignore_progress)

    async def run_in_background(self, kind: str, mode: str, payload: bytes, _budget_s: float) -> Solved | Needs:
        return await asyncio.to_thread(chunk.answer, kind, mode, payload, ignore_progress)
