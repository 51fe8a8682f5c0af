"""What leases are told by: a clock that is everybody's, and a name that is nobody else's."""

from __future__ import annotations

import os
import socket
import time

from sqlalchemy import Connection, func, select

LEASE_S = 15.0
"""So long what a process has leased stays with it though it gives no sign of life."""


def now(connection: Connection) -> float:
    """Unix time by the clock that all processes of this database share."""
    if connection.dialect.name == "postgresql":
        return float(connection.scalar(select(func.extract("epoch", func.clock_timestamp()))))
    return time.time()


def new_owner() -> str:
    """A name for a process that leases, unlike that of any other."""
    return f"{socket.gethostname()[:30]}:{os.getpid()}:{os.urandom(4).hex()}"
