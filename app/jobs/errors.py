"""How a solve in a worker can end without an answer."""

from __future__ import annotations


class JobError(Exception):
    """Base of everything the executor raises."""


class Busy(JobError):
    """Too many solves wait already; try again in about ``retry_s`` seconds."""

    def __init__(self, reason: str, retry_s: float = 1.0) -> None:
        super().__init__(reason)
        self.retry_s = retry_s


class ShareUsed(Busy):
    """Too many solves of this caller wait already, whatever others do."""


class Warming(Busy):
    """The kernels of this kind are being compiled."""

    def __init__(self, kind: str, remaining_s: float) -> None:
        super().__init__(f"the kernels of {kind} are being compiled; about {remaining_s:.0f} s are left", remaining_s)
        self.kind = kind


class BudgetExceeded(JobError):
    """The solve did not end within its wall-clock budget; its worker was killed."""

    def __init__(self, budget_s: float) -> None:
        super().__init__(f"the solve did not end within its budget of {budget_s:g} s")
        self.budget_s = budget_s


class WorkerCrashed(JobError):
    """The worker process died under the solve."""

    def __init__(self, exit_code: int | None) -> None:
        super().__init__(f"the worker process ended with code {exit_code} before it answered")
        self.exit_code = exit_code


class MemoryExceeded(JobError):
    """The solve wanted more memory than a worker may have."""


class SolveFailed(JobError):
    """The solve raised an exception nobody foresaw. ``detail``, its traceback, goes to the log, never to a client."""

    def __init__(self, exception: str, detail: str) -> None:
        super().__init__(f"the solve raised {exception}")
        self.exception = exception
        self.detail = detail


class ExecutorClosed(JobError):
    """The executor is shutting down."""
