"""When a request is sent again, and after how long.

Every POST carries an idempotency key, so that sending it again never solves or stores anything twice.
"""

from __future__ import annotations

import random
from dataclasses import dataclass

import httpx

AGAIN = frozenset({429, 502, 503, 504})
"""Statuses after which the same request may succeed."""


@dataclass(frozen=True)
class Retries:
    """``attempts`` in all; waits double from ``first_s`` to at most ``most_s``, but are as long as the service asks."""

    attempts: int = 6
    first_s: float = 0.25
    most_s: float = 30.0

    def wait_s(self, attempt: int, response: httpx.Response | None) -> float:
        """Seconds before the next attempt, after so many (from 1)."""
        asked = asked_wait_s(response)
        if asked is not None:
            return min(asked, self.most_s)
        longest = min(self.first_s * 2.0 ** (attempt - 1), self.most_s)
        # Clients that were refused together come back apart.
        return longest * random.uniform(0.5, 1.0)


def may_succeed(response: httpx.Response) -> bool:
    """Whether the same request may succeed later. A 504 of the service itself tells that a solve took too long, and
    would again; one of a proxy does not."""
    if response.status_code == 504 and "problem" in response.headers.get("content-type", ""):
        return False
    return response.status_code in AGAIN


def asked_wait_s(response: httpx.Response | None) -> float | None:
    """The wait that an answer asks for in seconds, if it does."""
    told = "" if response is None else response.headers.get("retry-after", "")
    try:
        return max(float(told), 0.0)
    except ValueError:
        return None
