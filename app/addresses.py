"""What a host name or address refers to."""

from __future__ import annotations

from functools import lru_cache
from ipaddress import ip_address

LOOPBACK_NAMES = frozenset({"localhost"})


@lru_cache(1024)
def is_address(host: str) -> bool:
    """Whether a host is an IP address."""
    try:
        ip_address(host)
    except ValueError:
        return False
    return True


@lru_cache(1024)
def is_loopback(host: str) -> bool:
    """Whether a host refers to this machine only."""
    return host in LOOPBACK_NAMES or (is_address(host) and ip_address(host).is_loopback)
