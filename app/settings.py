"""Settings of the service: CRANKWRIGHT_* variables, or command-line options of the same names."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import timedelta
from typing import Any

from pydantic import Field, ValidationError
from pydantic_settings import BaseSettings, SettingsConfigDict

from app.addresses import is_loopback
from app.designs.refusals import ALLOWED_BY_TYPE, LIMITS
from app.designs.schema import MAX_TIME_S
from app.invalid_settings import InvalidSettings
from app.logging import LogFormat, LogLevel
from app.store.leases import LEASE_S, LONGEST_LEASE_S

REQUESTS_PER_MINUTE = 1200
"""Default quota where other machines can reach the service."""


_PREFIX = "CRANKWRIGHT_"


class Settings(BaseSettings):
    """All settings with their defaults. Raises InvalidSettings."""

    model_config = SettingsConfigDict(env_prefix=_PREFIX, extra="ignore")

    def __init__(self, **given: Any) -> None:
        try:
            super().__init__(**given)
        except ValidationError as error:
            raise InvalidSettings("\n".join(map(_line, error.errors(include_url=False)))) from None

    host: str = Field(default="127.0.0.1", description="address to listen on")
    port: int = Field(default=8000, ge=0, le=65535, description="port to listen on")
    database_url: str = Field(default="sqlite:///crankwright.sqlite3", description="where runs are stored")
    database_password_file: str = Field(default="", description="a file with the password of a PostgreSQL server")
    workers: int = Field(default=2, ge=1, le=256, description="worker processes")
    solve_budget_s: float = Field(
        default=10.0, ge=0.01, le=MAX_TIME_S, description="wall-clock limit of a solve, in seconds"
    )
    solve_memory_bytes: int = Field(
        default=2 << 30, ge=16 << 20, le=1 << 42, description="memory limit of a solve, in bytes"
    )
    log_format: LogFormat = Field(
        default=LogFormat.CONSOLE, description="console for terminals, json for log collectors"
    )
    log_level: LogLevel = Field(default=LogLevel.WARNING, description="minimum severity of log records")
    form_patience_s: float = Field(
        default=2.0, ge=0.0, le=MAX_TIME_S, description="seconds a submitted form waits for its answer"
    )
    max_body_bytes: int = Field(default=1_000_000, ge=1_000, description="largest request body")
    max_batch_bytes: int = Field(default=4_000_000_000, ge=1_000, description="largest body of a batch")
    max_batch_items: int = Field(
        default=10_000_000, ge=1, le=2_000_000_000, description="maximum number of items of a batch"
    )
    max_batches_of_one: int = Field(
        default=200, ge=1, le=1_000_000, description="maximum number of unfinished batches of one owner"
    )
    cluster: str = Field(
        default="", description="address of a Dask scheduler whose workers solve batches; needs [cluster]"
    )
    batch_workers: int = Field(
        default=2,
        ge=0,
        le=256,
        description="low-priority worker processes for batches; 0: none in this process",
    )
    batch_niceness: int = Field(default=19, ge=0, le=19, description="nice value of the batch workers")
    lease_s: float = Field(
        default=LEASE_S,
        ge=0.2,
        le=LONGEST_LEASE_S,
        description="seconds of silence after which another process takes over batch chunks and accepted runs",
    )
    max_upload_bytes: int = Field(default=50_000_000, ge=1_000, description="largest batch file accepted by a page")
    max_body_names: int = Field(
        default=12_000, ge=100, description="maximum number of field names in a body, over all its objects"
    )
    body_idle_s: float = Field(default=10.0, ge=0.1, le=600, description="maximum pause within a body, in seconds")
    body_grace_s: float = Field(
        default=20.0, ge=0.1, le=3600, description="seconds for which a body may arrive at any rate"
    )
    body_least_bytes_per_s: float = Field(
        default=1000.0, ge=0, le=1e9, description="minimum mean rate of a body after that"
    )
    max_head_bytes: int = Field(default=32_768, ge=1_024, le=1_000_000, description="maximum size of a request's head")
    max_headers: int = Field(default=100, ge=10, le=10_000, description="maximum number of request headers")
    head_timeout_s: float = Field(
        default=10.0, ge=0.1, le=600, description="time limit for a request's head, in seconds"
    )
    unread_timeout_s: float = Field(
        default=30.0, ge=0.1, le=3600, description="seconds a client may leave a response unread"
    )
    max_connections: int = Field(default=1000, ge=1, le=100_000, description="maximum number of connections")
    max_connections_of_one: int = Field(
        default=250, ge=1, le=100_000, description="maximum number of connections per address"
    )
    max_requests: int = Field(default=500, ge=1, le=100_000, description="maximum number of concurrent requests")
    queue_patience_s: float = Field(
        default=30.0,
        ge=0.1,
        le=3600,
        description="seconds a request waits for a worker",
    )
    short_solve_s: float = Field(
        default=0.2,
        ge=0.05,
        le=600,
        description="seconds after which a check or analysis gives way and starts again",
    )
    max_waiting: int = Field(
        default=256, ge=1, le=100_000, description="maximum number of waiting short jobs, and of waiting long ones"
    )
    max_waiting_of_one: int = Field(default=64, ge=1, le=100_000, description="the same per caller")
    max_accepted: int = Field(
        default=200, ge=1, le=100_000, description="maximum number of open runs accepted with 202"
    )
    max_accepted_of_one: int = Field(default=50, ge=1, le=100_000, description="the same per caller")
    requests_per_minute: int | None = Field(
        default=None, ge=0, le=1_000_000, description="requests per minute and caller; 0: unlimited"
    )
    open: bool = Field(default=False, description="serve without keys even when reachable from other machines")
    trusted_proxies: str = Field(
        default="", description="addresses of trusted proxies for X-Forwarded-For, comma-separated"
    )
    idempotency_days: int = Field(
        default=30, ge=0, le=36_500, description="lifetime of idempotency keys in days; 0: unlimited"
    )
    session_hours: float = Field(default=12.0, ge=0.01, le=8760, description="lifetime of a login, in hours")
    drain_s: int = Field(
        default=10, ge=2, le=3600, description="time limit for finishing accepted work on shutdown, in seconds"
    )
    allowed_hosts: str = Field(
        default="", description="allowed host names, comma-separated; localhost and IP addresses always are"
    )

    @property
    def is_local(self) -> bool:
        """Whether the service listens on a loopback address only."""
        return is_loopback(self.host)

    @property
    def request_quota(self) -> int:
        """Requests per minute and caller; 0: unlimited, the default on loopback."""
        if self.requests_per_minute is None:
            return 0 if self.is_local else REQUESTS_PER_MINUTE
        return self.requests_per_minute

    @property
    def key_lifetime(self) -> timedelta | None:
        """Lifetime of idempotency keys; None: unlimited."""
        return timedelta(days=self.idempotency_days) if self.idempotency_days else None


def _line(error: Mapping[str, Any]) -> str:
    variable = f"{_PREFIX}{'_'.join(map(str, error['loc'])).upper()}"
    limits = [text.format(error["ctx"][name]) for name, text in LIMITS.items() if name in error.get("ctx", {})]
    allowed = ", ".join(limits) or ALLOWED_BY_TYPE.get(error["type"], error["msg"])
    return f"{variable} is {str(error['input'])!r}: allowed is {allowed}"
