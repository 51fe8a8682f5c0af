"""Who makes the request under way: for shares and quotas, and for what is logged."""

from __future__ import annotations

from contextvars import ContextVar
from dataclasses import dataclass
from ipaddress import IPv6Address, ip_address

_OF_ONE_SUBSCRIBER = 64
"""Bits of an IPv6 address that one subscriber cannot change."""


@dataclass(frozen=True)
class Caller:
    """``name`` tells callers apart: a key's id, else the address; empty for the service's own work."""

    name: str = ""
    address: str = ""
    scopes: frozenset[str] = frozenset()


caller: ContextVar[Caller] = ContextVar("caller", default=Caller())  # noqa: B039 (frozen)
"""Who calls, in this task and those that come from it."""


def name_of_address(address: str) -> str:
    """One name for all addresses that one subscriber can take."""
    try:
        parsed = ip_address(address)
    except ValueError:
        return address
    if isinstance(parsed, IPv6Address) and parsed.ipv4_mapped is None:
        return f"{IPv6Address(int(parsed) >> 64 << 64)}/{_OF_ONE_SUBSCRIBER}"
    return address
