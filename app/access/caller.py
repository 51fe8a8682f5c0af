"""The caller of the current request, for queueing, quotas and logs."""

from __future__ import annotations

from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from ipaddress import IPv6Address, ip_address

_IPV6_PREFIX = 64
"""Prefix length of the addresses of one IPv6 subscriber."""


@dataclass(frozen=True)
class Caller:
    """``name`` identifies a caller: the key's id, else the address; empty for the service's own work."""

    name: str = ""
    address: str = ""
    scopes: frozenset[str] = frozenset()


caller: ContextVar[Caller] = ContextVar("caller", default=Caller())  # noqa: B039 (frozen)
"""The caller of the current task and of the tasks it creates."""


@lru_cache(1024)
def name_of_address(address: str) -> str:
    """A common name for all addresses available to one subscriber."""
    try:
        parsed = ip_address(address)
    except ValueError:
        return address
    if isinstance(parsed, IPv6Address) and parsed.ipv4_mapped is None:
        return f"{IPv6Address(int(parsed) >> 64 << 64)}/{_IPV6_PREFIX}"
    return address
