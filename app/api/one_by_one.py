"""Large bodies are validated one by one, so that many at once do not block the event loop."""

from __future__ import annotations

import asyncio


class OneByOne:
    """Lets waiting tasks continue one by one, with a pass of the event loop between them.

    To validate and hash a large body takes up to 15 ms, in which nothing else runs. However many arrive at once, other
    requests get on between two of them.
    """

    def __init__(self) -> None:
        self._lock = asyncio.Lock()

    async def turn(self) -> None:
        """Wait for one's turn; it lasts until the caller waits for anything else."""
        async with self._lock:
            await asyncio.sleep(0)
