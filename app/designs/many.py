"""Bulk evaluation of requests of one kind and mode."""

from __future__ import annotations

import traceback
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError

from app.designs.kind import REFUSED, Answer, Detail, Job, Mode
from app.designs.problems import INVALID, SOLVER_FAILED, problem_details
from app.designs.refusals import summarize
from app.designs.registry import KINDS, job_of
from app.designs.schema import Entry
from app.logging import get_logger

logger = get_logger(__name__)


def answer_many(slug: str, mode: Mode, bodies: Sequence[Mapping[str, Any]], detail: Detail) -> list[Answer]:
    """Answer every body in order, as a single request would be; without the job's ``tables`` unless ``detail`` is full.

    Failures are isolated: an invalid body gets a "refused" answer with a problem that names its fields, a solve that
    raises a "failed" one. Raises KeyError for an unknown kind or mode, and MemoryError.
    """
    job = job_of(KINDS[slug], Mode(mode))
    found: list[Answer | None] = []
    requests: list[BaseModel] = []
    for body in bodies:
        request, refused = validated(job, body)
        found.append(refused)
        if request is not None:
            requests.append(request)
    answers = answers_of(slug, mode, requests, detail)
    return [next(answers) if answer is None else answer for answer in found]


def validated(job: Job, body: Mapping[str, Any]) -> tuple[BaseModel, None] | tuple[None, Answer]:
    """Validate a body; the request, or the refusing answer."""
    try:
        request = job.request.__pydantic_validator__.validate_python(body)
    except ValidationError as error:
        return None, refusal(*summarize(error.errors(include_url=False), model=job.request))
    if contradictions := request.contradictions():  # type: ignore[attr-defined]
        return None, refusal("values contradict each other", contradictions)
    return request, None


def refusal(detail: str, errors: list[Entry]) -> Answer:
    """The answer to a request that cannot be solved; ``errors`` name its fields."""
    return Answer(REFUSED, None, [], None, {}, problem_details(INVALID, 422, detail, errors))


def failure(title: str, detail: str, status: int = 500) -> Answer:
    """The answer to a request whose solve ended without one."""
    return Answer("failed", None, [], None, {}, problem_details(title, status, detail))


def answers_of(slug: str, mode: Mode, requests: Sequence[BaseModel], detail: Detail) -> Iterator[Answer]:
    """Answer validated requests: in bulk if the job can, else, or as soon as that raises, one by one.

    Whoever uses up each answer before the next one is made has it in the processor's cache.
    """
    job, left = job_of(KINDS[slug], Mode(mode)), iter(requests)
    if job.run_many is not None:
        try:
            # A request leaves ``left`` after its answer has come.
            for answer, _ in zip(job.run_many(requests, detail), left, strict=False):
                yield answer
        except MemoryError:
            raise
        except Exception:
            logger.exception("solve_many_failed", kind=slug, mode=str(mode), items=len(requests))
    for request in left:
        yield _one(slug, mode, job, request, detail)


def _one(slug: str, mode: Mode, job: Job, request: BaseModel, detail: Detail) -> Answer:
    try:
        return without_tables(job, job.solve(request), detail)
    except MemoryError:
        raise
    except Exception as error:
        logger.error("solve_failed", kind=slug, mode=str(mode), reason=repr(error), exception=traceback.format_exc())
        return failure(SOLVER_FAILED, "the solve ended without an answer")


def without_tables(job: Job, answer: Answer, detail: Detail) -> Answer:
    """The answer without its tables unless ``detail`` is full."""
    if detail is Detail.FULL or answer.result is None:
        return answer
    return answer._replace(result={name: value for name, value in answer.result.items() if name not in job.tables})
