"""The log: all records of the service and its libraries, one line each on standard error.

Records made with structlog and with the standard library's ``logging`` share one pipeline, so no traceback is lost.
structlog is imported with the first record, because a check on the command line logs nothing and the import takes
longer than the check.
"""

from __future__ import annotations

import logging
import sys
from contextvars import ContextVar
from enum import StrEnum
from functools import cache
from typing import TYPE_CHECKING, Any, TextIO, cast

if TYPE_CHECKING:
    from structlog.stdlib import BoundLogger


class LogFormat(StrEnum):
    """``console`` for terminals, ``json`` for log collectors, with tracebacks in ``exception``."""

    CONSOLE = "console"
    JSON = "json"


class LogLevel(StrEnum):
    """Minimum severity of records."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


request_id: ContextVar[str | None] = ContextVar("request_id", default=None)
"""The id of the current request, added to its records."""
_LEVELS = logging.getLevelNamesMapping()


class _Handler(logging.StreamHandler):
    """The service's handler, distinguishable from those added by others to the root logger."""


class _LazyLogger:
    """A logger that imports structlog with its first record; records below its level cost next to nothing."""

    def __init__(self, name: str) -> None:
        self._name, self._logger = name, logging.getLogger(name)

    def __getattr__(self, severity: str) -> Any:
        if not self._logger.isEnabledFor(_LEVELS.get(severity.upper(), logging.ERROR)):
            return _ignored
        from structlog.stdlib import get_logger

        _shared()
        return getattr(get_logger(self._name), severity)


def _ignored(*_given: Any, **_named: Any) -> None:
    """A record below the level."""


def _with_request_id(_logger: Any, _method: str, record: dict[str, Any]) -> dict[str, Any]:
    current = request_id.get()
    return record if current is None else {"request_id": current, **record}


def get_logger(name: str) -> BoundLogger:
    """A structured logger: ``get_logger(__name__).error("solver_failed", run_id=…)``."""
    return cast("BoundLogger", _LazyLogger(name))


@cache
def _shared() -> list[Any]:
    """Processors applied to every record; also configures structlog."""
    import structlog

    shared: list[Any] = [
        _with_request_id,
        structlog.stdlib.add_logger_name,
        structlog.stdlib.add_log_level,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
        structlog.processors.format_exc_info,
    ]
    structlog.configure(
        processors=[structlog.stdlib.filter_by_level, *shared, structlog.stdlib.ProcessorFormatter.wrap_for_formatter],
        logger_factory=structlog.stdlib.LoggerFactory(),
        wrapper_class=structlog.stdlib.BoundLogger,
        cache_logger_on_first_use=True,
    )
    return shared


def configure(form: LogFormat, level: LogLevel, stream: TextIO | None = None) -> None:
    """Write records from ``level`` up to ``stream`` (default: standard error). A second call replaces the first."""
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
