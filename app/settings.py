"""Settings of the service: CRANKWRIGHT_* variables, or the command line's options of the same names."""

from __future__ import annotations

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from app.designs.schema import GREATEST_TIME_S
from app.logging import LogFormat, LogLevel


class Settings(BaseSettings):
    """Every setting with its default."""

    model_config = SettingsConfigDict(env_prefix="CRANKWRIGHT_", extra="ignore")

    host: str = Field(default="127.0.0.1", description="address to listen on")
    port: int = Field(default=8000, ge=0, le=65535, description="port to listen on")
    database_url: str = Field(default="sqlite:///crankwright.sqlite3", description="where runs are stored")
    workers: int = Field(default=2, ge=1, le=256, description="processes that solve")
    solve_budget_s: float = Field(
        default=10.0, ge=0.01, le=GREATEST_TIME_S, description="wall-clock time one solve may take"
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
    batch_lease_s: float = Field(
        default=15.0, ge=0.2, le=600.0, description="after what silence another process takes over a piece of a batch"
    )
