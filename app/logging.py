"""The service's log: every record of the service and of its libraries, one line each on standard error.

Records made through structlog and through the standard library's ``logging`` take the same way, so a traceback is never
lost for where it came from.
"""

from __future__ import annotations

import logging
import sys
from enum import StrEnum
from typing import TextIO

import structlog

_SHARED = [
    structlog.contextvars.merge_contextvars,
    structlog.stdlib.add_logger_name,
    structlog.stdlib.add_log_level,
    structlog.processors.TimeStamper(fmt="iso", utc=True),
    structlog.processors.format_exc_info,
]

structlog.configure(
    processors=[
        structlog.stdlib.filter_by_level,
        *_SHARED,
        structlog.stdlib.ProcessorFormatter.wrap_for_formatter,
    ],
    logger_factory=structlog.stdlib.LoggerFactory(),
    wrapper_class=structlog.stdlib.BoundLogger,
    cache_logger_on_first_use=True,
)


class LogFormat(StrEnum):
    """``console`` for people at a terminal, ``json`` for a collector, with tracebacks in ``exception``."""

    CONSOLE = "console"
    JSON = "json"


class LogLevel(StrEnum):
    """The least severe records that are written."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class _Handler(logging.StreamHandler):
    """The service's own handler, told from those that others put on the root logger."""


def get_logger(name: str) -> structlog.stdlib.BoundLogger:
    """A logger of events with named fields: ``get_logger(__name__).error("solver_failed", run_id=…)``."""
    return structlog.stdlib.get_logger(name)


def configure(form: LogFormat, level: LogLevel, stream: TextIO | None = None) -> None:
    """Write all records of at least ``level`` to ``stream`` (standard error); a second call replaces the first."""
    stream = stream or sys.stderr
    handler = _Handler(stream)
    renderer = (
        structlog.processors.JSONRenderer(ensure_ascii=False)
        if form is LogFormat.JSON
        else structlog.dev.ConsoleRenderer(colors=stream.isatty(), exception_formatter=structlog.dev.plain_traceback)
    )
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=_SHARED,
            processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, renderer],
        )
    )
    root = logging.getLogger()
    for former in [known for known in root.handlers if isinstance(known, _Handler)]:
        root.removeHandler(former)
    root.addHandler(handler)
    root.setLevel(level.upper())
