"""Settings of the service: CRANKWRIGHT_* variables, or the command line's options of the same names."""

from __future__ import annotations

from datetime import timedelta

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from app.designs.schema import GREATEST_TIME_S
from app.edge.hosts import is_loopback
from app.logging import LogFormat, LogLevel
from app.store.leases import LEASE_S

REQUESTS_PER_MINUTE = 1200
"""The quota where others reach the service."""


class Settings(BaseSettings):
    """Every setting with its default."""

    model_config = SettingsConfigDict(env_prefix="CRANKWRIGHT_", extra="ignore")

    host: str = Field(default="127.0.0.1", description="address to listen on")
    port: int = Field(default=8000, ge=0, le=65535, description="port to listen on")
    database_url: str = Field(default="sqlite:///crankwright.sqlite3", description="where runs are stored")
    database_password_file: str = Field(default="", description="a file with the password of a PostgreSQL server")
    workers: int = Field(default=2, ge=1, le=256, description="processes that solve")
    solve_budget_s: float = Field(
        default=10.0, ge=0.01, le=GREATEST_TIME_S, description="wall-clock time one solve may take"
    )
    solve_memory_bytes: int = Field(
        default=2 << 30, ge=16 << 20, le=1 << 42, description="memory that one solve may take"
    )
    log_format: LogFormat = Field(default=LogFormat.CONSOLE, description="console for people, json for a collector")
    log_level: LogLevel = Field(default=LogLevel.WARNING, description="the least severe records that are written")
    form_patience_s: float = Field(
        default=2.0, ge=0.0, le=GREATEST_TIME_S, description="how long a sent form waits for its answer"
    )
    max_body_bytes: int = Field(default=1_000_000, ge=1_000, description="the largest request body accepted")
    max_batch_bytes: int = Field(default=4_000_000_000, ge=1_000, description="the largest body of a batch accepted")
    max_batch_items: int = Field(default=10_000_000, ge=1, le=2_000_000_000, description="the most items of a batch")
    cluster: str = Field(default="", description="a Dask scheduler whose workers solve batches; needs [cluster]")
    batch_workers: int = Field(
        default=2,
        ge=0,
        le=256,
        description="processes that solve batches, behind all others; 0: this process solves none",
    )
    batch_niceness: int = Field(default=19, ge=0, le=19, description="how far they stand back for all others")
    lease_s: float = Field(
        default=LEASE_S,
        ge=0.2,
        le=600.0,
        description="after what silence of a process another takes over its pieces of batches and promised runs",
    )
    max_upload_bytes: int = Field(
        default=50_000_000, ge=1_000, description="the largest file of a batch that a page takes"
    )
    max_body_names: int = Field(
        default=20_000, ge=100, description="names of fields that one body may have, all its objects together"
    )
    body_idle_s: float = Field(default=10.0, ge=0.1, le=600, description="a body may pause so long")
    body_grace_s: float = Field(default=20.0, ge=0.1, le=3600, description="so long a body may come at any rate")
    body_least_bytes_per_s: float = Field(
        default=1000.0, ge=0, le=1e9, description="the least mean rate of a body after that"
    )
    max_head_bytes: int = Field(default=32_768, ge=1_024, le=1_000_000, description="the longest head of a request")
    max_headers: int = Field(default=100, ge=10, le=10_000, description="the most headers of a request")
    head_timeout_s: float = Field(default=10.0, ge=0.1, le=600, description="a head must arrive within that time")
    unread_timeout_s: float = Field(default=30.0, ge=0.1, le=3600, description="an answer may stay unread so long")
    max_connections: int = Field(default=1000, ge=1, le=100_000, description="connections at once")
    max_connections_of_one: int = Field(default=250, ge=1, le=100_000, description="connections of one address")
    max_requests: int = Field(default=500, ge=1, le=100_000, description="requests under way at once")
    queue_patience_s: float = Field(
        default=30.0,
        ge=0.1,
        le=3600,
        description="so long a request waits for a worker",
    )
    short_solve_s: float = Field(
        default=1.0, ge=0.05, le=600, description="after that a check or an analysis counts as long work"
    )
    max_waiting: int = Field(default=256, ge=1, le=100_000, description="short solves, and long ones, that may wait")
    max_waiting_of_one: int = Field(default=64, ge=1, le=100_000, description="the same of one caller")
    max_accepted: int = Field(default=200, ge=1, le=100_000, description="open runs that were promised by a 202")
    max_accepted_of_one: int = Field(default=50, ge=1, le=100_000, description="the same of one caller")
    requests_per_minute: int | None = Field(
        default=None, ge=0, le=1_000_000, description="requests of one caller; 0: any number"
    )
    open: bool = Field(default=False, description="answer everybody, without keys, wherever the service is bound")
    trusted_proxies: str = Field(
        default="", description="addresses of proxies whose X-Forwarded-For is believed, with commas between"
    )
    idempotency_days: int = Field(
        default=30, ge=0, le=36_500, description="so many days an idempotency key is good; 0: for ever"
    )
    session_hours: float = Field(default=12.0, ge=0.01, le=8760, description="how long a login lasts")
    drain_s: int = Field(default=10, ge=2, le=3600, description="how long the service finishes its work when it stops")
    allowed_hosts: str = Field(
        default="", description="names the service answers under, with commas between; localhost and addresses always"
    )

    @property
    def is_local(self) -> bool:
        """Whether nobody but this machine can reach the service."""
        return is_loopback(self.host)

    @property
    def request_quota(self) -> int:
        """Requests of one caller in a minute; 0: any number, the default where only this machine reaches it."""
        if self.requests_per_minute is None:
            return 0 if self.is_local else REQUESTS_PER_MINUTE
        return self.requests_per_minute

    @property
    def keys_kept(self) -> timedelta | None:
        """How long idempotency keys are good; None: for ever."""
        return timedelta(days=self.idempotency_days) if self.idempotency_days else None
