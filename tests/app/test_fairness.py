"""Fairness under load: short jobs proceed, per-caller limits hold, statuses are correct."""

from __future__ import annotations

import asyncio
import json
import time
from collections import Counter
from collections.abc import Iterator
from functools import partial
from typing import Any

import httpx
import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of
from tests.app.running import Running, wait_until

EXAMPLE = example_of(KINDS["flexible-rod"], Mode.ACCURACY)
STUDY = {"spec": {**EXAMPLE["spec"], "accuracy": 1e-12}, "study_budget_s": 2.0}
CHECK = KINDS["pin-profile"].example(Mode.CHECK)
STUDIES, CHECKS = "/api/v1/accuracy/flexible-rod", "/api/v1/checks/pin-profile"
LATER = {"Prefer": "respond-async"}


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("flooded")
    settings = {"max_accepted_of_one": 6, "max_waiting_of_one": 4, "queue_patience_s": 3, "solve_budget_s": 20}
    with Running(folder, workers=2, **settings) as running, running.client() as client:
        wait_until(lambda: running.ready(client), 170.0)
        client.post(CHECKS, json=CHECK)
        yield str(client.base_url)


def different(number: int) -> dict:
    """A check with no cached answer."""
    return {**CHECK, "effect_tolerance": 0.01 + number * 1e-6}


def test_many_studies_leave_a_worker_to_checks(service):
    async def flood() -> tuple[list[httpx.Response], list[httpx.Response], list[float], list[Any]]:
        async with httpx.AsyncClient(base_url=service, timeout=60) as client:
            later = [client.post(STUDIES, json=STUDY, headers=LATER) for _ in range(20)]
            promised = await asyncio.gather(*later)
            now = asyncio.gather(*(client.post(STUDIES, json=STUDY) for _ in range(20)))
            await asyncio.sleep(0.3)
            seconds = []
            for k in range(20):
                began = time.monotonic()
                answer = await client.post(CHECKS, json=different(k))
                seconds.append(time.monotonic() - began)
                assert answer.status_code == 201 and answer.json()["status"] == "succeeded"
            places = [answer.headers["Location"] for answer in promised if answer.status_code == 202]
            # At one moment: while places are read in turn, one study ends and the next begins.
            running = (await client.get("/api/v1/runs", params={"status": "running"})).json()["items"]
            answers = await now
            for place in places:
                await client.delete(place)
        return promised, answers, seconds, running

    promised, answers, seconds, running = asyncio.run(flood())
    assert Counter(answer.status_code for answer in promised) == {202: 6, 429: 14}
    told = Counter(answer.status_code for answer in answers)
    assert told[429] >= 10 and told.keys() <= {201, 429, 503}, told
    for answer in (*promised, *answers):
        if answer.status_code in (429, 503):
            assert int(answer.headers["Retry-After"]) >= 1
            assert answer.headers["content-type"] == "application/problem+json"
    assert len(running) <= 1, "one worker is for long work, and what waits says so"
    # Queued behind the studies, each would wait for at least two seconds. An idle machine needs 30 ms; tests run in
    # parallel.
    assert sorted(seconds)[len(seconds) // 2] < 1.0
    assert max(seconds) < 10.0


def test_a_disconnect_cancels_the_solve_and_stores_nothing(service):
    name = "nobody waits for this"
    with httpx.Client(base_url=service, timeout=0.5) as client, pytest.raises(httpx.ReadTimeout):
        client.post(STUDIES, json={"spec": {**STUDY["spec"], "name": name}, "study_budget_s": 15.0})
    with httpx.Client(base_url=service, timeout=30) as client:
        began = time.monotonic()
        # The worker for long work is free again: this would wait for the other's fifteen seconds.
        assert client.post(STUDIES, json=STUDY).status_code == 201
        assert time.monotonic() - began < 12.0
        assert client.get("/api/v1/runs", params={"text": name}).json()["items"] == []


def test_concurrent_requests_with_one_key_share_a_solve(service):
    design = {**KINDS["flexible-rod"].example(Mode.DESIGN), "name": "once"}

    async def fifty() -> list[httpx.Response]:
        async with httpx.AsyncClient(base_url=service, timeout=60) as client:
            key = {"Idempotency-Key": "fifty at once"}
            body = json.dumps(design).encode()
            headers = {**key, "Content-Type": "application/json"}
            send = partial(client.post, "/api/v1/designs/flexible-rod", headers=headers)
            same = await asyncio.gather(*(send(content=body) for _ in range(50)))
            # Sent together with them, another content might come first, and the key would be its own.
            return [*same, await send(content=body + b" ")]

    *answers, other = asyncio.run(fifty())
    assert {answer.status_code for answer in answers} == {201}
    assert len({answer.content for answer in answers}) == 1
    assert other.status_code == 409
    listed = httpx.get(f"{service}/api/v1/runs", params={"name": "once"}).json()["items"]
    assert len(listed) == 1
