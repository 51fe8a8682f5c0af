"""Errors of the executor: how a solve can end without an answer."""

from __future__ import annotations


class JobError(Exception):
    """Base of all executor errors."""


class Busy(JobError):
    """Too many solves are waiting; retry after about ``retry_s`` seconds."""

    def __init__(self, reason: str, retry_s: float = 1.0) -> None:
        super().__init__(reason)
        self.retry_s = retry_s


class ShareUsed(Busy):
    """Too many solves of this caller are waiting."""


class Warming(Busy):
    """The kernels of this kind are being compiled."""

    def __init__(self, kind: str, remaining_s: float) -> None:
        super().__init__(f"the kernels of {kind} are being compiled; about {remaining_s:.0f} s are left", remaining_s)
        self.kind = kind


class BudgetExceeded(JobError):
    """The solve exceeded its wall-clock budget and its worker was killed."""

    def __init__(self, budget_s: float) -> None:
        super().__init__(f"the solve was stopped after {budget_s:g} s without an answer")
        self.budget_s = budget_s


class WorkerCrashed(JobError):
    """The worker process died during the solve."""

    def __init__(self, exit_code: int | None) -> None:
        super().__init__(f"the worker process ended with code {exit_code} before it answered")
        self.exit_code = exit_code


class MemoryExceeded(JobError):
    """The solve exceeded the memory limit of a worker."""


class SolveFailed(JobError):
    """The solve raised an unexpected exception. ``detail`` is its traceback, for the log only, never for a client."""

    def __init__(self, exception: str, detail: str) -> None:
        super().__init__(f"the solve raised {exception}")
        self.exception = exception
        self.detail = detail


class ExecutorClosed(JobError):
    """The executor is shutting down."""
