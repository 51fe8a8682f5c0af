"""Many requests of one kind and mode, answered one by one or, where a kind knows a quicker way, all at once."""

from __future__ import annotations

import traceback
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pydantic import BaseModel, ValidationError

from app.designs.kind import REFUSED, Answer, Detail, Job, Mode
from app.designs.problems import INVALID, SOLVER_FAILED, problem_details
from app.designs.refusals import summed_up
from app.designs.registry import KINDS, job_of
from app.designs.schema import Entry
from app.logging import get_logger

logger = get_logger(__name__)


def answer_many(slug: str, mode: Mode, bodies: Sequence[Mapping[str, Any]], detail: Detail) -> list[Answer]:
    """One answer for every body, in their order: what a request of its own would be answered, without the job's
    ``tables`` unless ``detail`` is full.

    What one body suffers touches no other: an invalid one is answered "refused" with a problem that names its fields,
    one whose solve raises is answered "failed". Raises KeyError for a kind or mode that there is not, and MemoryError.
    """
    job = job_of(KINDS[slug], Mode(mode))
    found: list[Answer | None] = []
    requests: list[BaseModel] = []
    for body in bodies:
        request, refused = accepted(job, body)
        found.append(refused)
        if request is not None:
            requests.append(request)
    answers = iter(answers_of(slug, mode, requests, detail))
    return [next(answers) if answer is None else answer for answer in found]


def accepted(job: Job, body: Mapping[str, Any]) -> tuple[BaseModel, None] | tuple[None, Answer]:
    """The request of a body, or the answer that refuses it."""
    try:
        request = job.request.model_validate(body)
    except ValidationError as error:
        return None, _refusal(*summed_up(error.errors(include_url=False), model=job.request))
    if contradictions := request.contradictions():  # type: ignore[attr-defined]
        return None, _refusal("values contradict each other", contradictions)
    return request, None


def _refusal(detail: str, errors: list[Entry]) -> Answer:
    return Answer(REFUSED, None, [], None, {}, problem_details(INVALID, 422, detail, errors))


def answers_of(slug: str, mode: Mode, requests: Sequence[BaseModel], detail: Detail) -> Iterable[Answer]:
    """One answer for every request that was ``accepted``; one by one where no way for many is known or, for what only
    one of them may suffer, where that way raised."""
    job = job_of(KINDS[slug], Mode(mode))
    if job.run_many is not None:
        try:
            return job.run_many(requests, detail)
        except MemoryError:
            raise
        except Exception:
            logger.exception("solve_many_failed", kind=slug, mode=str(mode), items=len(requests))
    return (_one(slug, mode, job, request, detail) for request in requests)


def _one(slug: str, mode: Mode, job: Job, request: BaseModel, detail: Detail) -> Answer:
    try:
        return shortened(job, job.solve(request), detail)
    except MemoryError:
        raise
    except Exception as error:
        logger.error("solve_failed", kind=slug, mode=str(mode), reason=repr(error), exception=traceback.format_exc())
        problem = problem_details(SOLVER_FAILED, 500, "the solve ended without an answer")
        return Answer("failed", None, [], None, {}, problem)


def shortened(job: Job, answer: Answer, detail: Detail) -> Answer:
    """The answer with as much of its result as is wanted."""
    if detail is Detail.FULL or answer.result is None:
        return answer
    return replace(answer, result={name: value for name, value in answer.result.items() if name not in job.tables})
