"""The service's log: every record of the service and of its libraries, one line each on standard error.

Records made through structlog and through the standard library's ``logging`` take the same way, so a traceback is never
lost for where it came from. The library that writes them is imported with the first: a check on the command line says
nothing, and would wait for its pretty tracebacks longer than for its own answer.
"""

from __future__ import annotations

import logging
import sys
from enum import StrEnum
from functools import cache
from typing import TYPE_CHECKING, Any, TextIO, cast

if TYPE_CHECKING:
    from structlog.stdlib import BoundLogger


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


class _WhenUsed:
    """A logger that is made with its first record."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, severity: str) -> Any:
        from structlog.stdlib import get_logger

        _shared()
        return getattr(get_logger(self._name), severity)


def get_logger(name: str) -> BoundLogger:
    """A logger of events with named fields: ``get_logger(__name__).error("solver_failed", run_id=…)``."""
    return cast("BoundLogger", _WhenUsed(name))


@cache
def _shared() -> list[Any]:
    """What is done to every record, of whomever; the library is told of it."""
    import structlog

    shared: list[Any] = [
        structlog.contextvars.merge_contextvars,
        structlog.stdlib.add_logger_name,
        structlog.stdlib.add_log_level,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
        structlog.processors.format_exc_info,
    ]
    structlog.configure(
        processors=[
            structlog.stdlib.filter_by_level,
            *shared,
            structlog.stdlib.ProcessorFormatter.wrap_for_formatter,
        ],
        logger_factory=structlog.stdlib.LoggerFactory(),
        wrapper_class=structlog.stdlib.BoundLogger,
        cache_logger_on_first_use=True,
    )
    return shared


def configure(form: LogFormat, level: LogLevel, stream: TextIO | None = None) -> None:
    """Write all records of at least ``level`` to ``stream`` (standard error); a second call replaces the first."""
    import structlog

    stream = stream or sys.stderr
    handler = _Handler(stream)
    renderer = (
        structlog.processors.JSONRenderer(ensure_ascii=False)
        if form is LogFormat.JSON
        else structlog.dev.ConsoleRenderer(colors=stream.isatty(), exception_formatter=structlog.dev.plain_traceback)
    )
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=_shared(),
            processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, renderer],
        )
    )
    root = logging.getLogger()
    for former in [known for known in root.handlers if isinstance(known, _Handler)]:
        root.removeHandler(former)
    root.addHandler(handler)
    root.setLevel(level.upper())
