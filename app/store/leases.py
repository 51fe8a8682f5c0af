"""Leases: the shared clock they are measured by, and unique owner names."""

from __future__ import annotations

import os
import socket
import time

from sqlalchemy import ColumnElement, Connection, func, or_, select

LEASE_S = 15.0
"""Lease duration in seconds: a process silent for longer loses its leases."""
LONGEST_LEASE_S = 600.0
"""Longest lease duration that can be set, in seconds."""


def now(connection: Connection) -> float:
    """Unix time in seconds, by the clock shared by all processes of the database."""
    if connection.dialect.name == "postgresql":
        return float(connection.scalar(select(func.extract("epoch", func.clock_timestamp()))))
    return time.time()


def expired(leased_until: ColumnElement[float], time_now: float) -> ColumnElement[bool]:
    """Whether leases have expired. So have those that end later than any given now could: the clock was set back."""
    return or_(leased_until < time_now, leased_until > time_now + LONGEST_LEASE_S)


def new_owner() -> str:
    """A unique owner name for this process."""
    return f"{socket.gethostname()[:30]}:{os.getpid()}:{os.urandom(4).hex()}"
