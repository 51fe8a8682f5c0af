"""Problem types (RFC 9457), each with a documented type URI."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

UNTYPED = "about:blank"
"""The type of problems fully described by their HTTP status."""

INVALID = "The request is not valid"
OUT_OF_TIME = "The time budget ran out"
SOLVER_FAILED = "The solver failed"
DAMAGED, NOT_SHOWN = (
    "The record is damaged",
    "the stored record does not match its hash and is not shown; run crankwright verify for details",
)
"""Title and detail of the problem of a damaged record."""
DISK_FULL, NO_ROOM = "The disk is full", "there is no room for the file that was sent; nothing was stored"
"""Title and detail of the problem of a full temporary directory."""

MEANINGS: Mapping[str, str] = MappingProxyType(
    {
        INVALID: "Some fields cannot be accepted; errors names each by its pointer and says what is allowed.",
        "Not JSON": "The body is not sent as application/json.",
        "The request is too large": "The body has more bytes than the service takes.",
        "The request is compressed": "The body was sent with a Content-Encoding; bodies are taken uncompressed only.",
        "The idempotency key is taken": "The same key came with another request before: take a new one.",
        "No such kind": "There is no such kind of design, or it has no such mode; detail lists those there are.",
        "No such run": "No run has this id.",
        "No such batch": "No batch has this id.",
        "No such plot": "The kind has no plot of this name; every run lists its own under links.",
        "Nothing to draw": "The run has no result, or nothing in it for this plot.",
        "The plot took too long to draw": "A plot reached the time that the service gives a solve.",
        "No such export": "The kind has no export of this name; every run lists its own under links.",
        "Nothing to export": "The run has no result, or nothing in it for this export.",
        "The file took too long to make": "An export reached the time that the service gives it.",
        "The file could not be made": "An export failed; the fault is the service's.",
        "The run has ended": "What has ended cannot be cancelled; nothing is ever deleted.",
        "The batch has ended": "What has ended cannot be cancelled; what is done stays.",
        "No batch": "The body is in none of the forms of a batch.",
        "The batch is too large": "More items or bytes than the service takes in one batch.",
        "No Parquet": "The body cannot be read as Parquet.",
        "No Parquet here": "The service was installed without Parquet.",
        OUT_OF_TIME: "Nothing was found, or nothing that is admissible, before the time was over; more time or less "
        "accuracy may help.",
        "The memory bound was reached": "The solve needed more memory than the service gives it.",
        SOLVER_FAILED: "The solve ended without an answer; the fault is the service's.",
        "The result is not finite": "The solver gave a number that JSON cannot carry; the fault is the service's.",
        "The service stopped": "It ended before the run did.",
        "The service stops": "It is being stopped: send the request again later.",
        "The kernels are being compiled": "The service has just been started; Retry-After says how long it takes.",
        "Too much work waits": "Send the request again after Retry-After.",
        "Too many requests": "The caller's share is used; Retry-After says for how long.",
        "Your share is used": "As much of the caller's work waits as may: send it again after Retry-After.",
        "Too many requests at once": "The service answers as many as it can: send the request again later.",
        "The request came too slowly": "The body did not arrive in time.",
        "The batch took too long": "The body of the batch did not arrive in time.",
        "Too many headers": "The head of the request has more headers than the service takes.",
        "The head is too long": "The head of the request has more bytes than the service takes.",
        "Another host": "The service does not answer under this host name.",
        "Another site": "A page of another site sent this; only pages of this service may.",
        "Not from a page of this session": "A form was sent that this session was not shown: load the page again.",
        "No valid key": "A key is asked for, and none that is valid was sent.",
        "Beyond the key's scope": "The key is valid, but not for this.",
        "The store cannot be used": "The database cannot do now what it must; nothing was stored.",
        DISK_FULL: "The service has no room for a file that was sent; nothing was stored.",
        DAMAGED: "What is stored no longer says what was written, so it is not shown.",
        "Something went wrong": "The request was understood; the fault is the service's.",
    }
)
"""Explanation of each problem type, by title."""


def anchor(title: str) -> str:
    """HTML anchor of a problem type in the API reference."""
    return "problem-" + re.sub(r"[^a-z]+", "-", title.lower()).strip("-")


def problem_type(title: str) -> str:
    """The type URI: the section of the service's reference."""
    return f"/docs#{anchor(title)}" if title in MEANINGS else UNTYPED


def problem_details(title: str, status: int, detail: str, errors: list[Any] | None = None) -> dict[str, Any]:
    """A problem as sent and stored."""
    found: dict[str, Any] = {"type": problem_type(title), "title": title, "status": status, "detail": detail}
    return found if errors is None else {**found, "errors": errors}
