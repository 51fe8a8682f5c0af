"""Retry policy.

Every POST carries an idempotency key, so a retry never solves or stores anything twice.
"""

from __future__ import annotations

import random
import time
from dataclasses import dataclass

import httpx

AGAIN = frozenset({429, 502, 503, 504})
"""Statuses after which a retry may succeed."""

MAY_PASS = (httpx.NetworkError, httpx.TimeoutException, httpx.RemoteProtocolError, httpx.ProxyError)
"""Transport errors after which a retry may succeed; others, such as a header that cannot be sent, are the caller's."""


@dataclass(frozen=True)
class Retries:
    """``attempts`` in total; delays double from ``first_s`` up to ``most_s``, unless the service sends Retry-After.

    While a run, a batch or its results are waited for, attempts go on for ``waiting_s`` at least: the service solves
    without its client, and after a restart goes on.
    """

    attempts: int = 6
    first_s: float = 0.25
    most_s: float = 30.0
    waiting_s: float = 300.0

    def until(self, ends: float | None) -> float:
        """The monotonic time until which a look at a run, a batch or its results is repeated; ``ends`` is when waiting
        ends."""
        patient = time.monotonic() + self.waiting_s
        return patient if ends is None else min(patient, ends)

    def used_up(self, attempt: int, until: float) -> bool:
        """Whether this attempt (from 1) was the last of a request repeated until a monotonic time."""
        return attempt >= self.attempts and time.monotonic() >= until

    def wait_s(self, attempt: int, response: httpx.Response | None) -> float:
        """Seconds before the next attempt, after ``attempt`` attempts (from 1)."""
        asked = asked_wait_s(response)
        if asked is not None:
            return min(max(asked, self.first_s), self.most_s)
        longest = min(self.first_s * 2.0 ** min(attempt - 1, 60), self.most_s)
        # jitter, so that clients refused together do not return together
        return longest * random.uniform(0.5, 1.0)


def may_succeed(response: httpx.Response) -> bool:
    """Whether a retry may succeed. A 504 of the service itself means that the solve timed out and would again; one of a
    proxy does not."""
    if response.status_code == 504 and "problem" in response.headers.get("content-type", ""):
        return False
    return response.status_code in AGAIN


def asked_wait_s(response: httpx.Response | None) -> float | None:
    """The Retry-After of a response in seconds, if any."""
    told = "" if response is None else response.headers.get("retry-after", "")
    try:
        return max(float(told), 0.0)
    except ValueError:
        return None
