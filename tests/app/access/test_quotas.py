"""Request quotas: exact limits and a correct Retry-After."""

from __future__ import annotations

import asyncio
import json

import pytest
from limits import strategies

from app.access.caller import Caller, caller, name_of_address
from app.access.quotas import Quotas
from app.settings import REQUESTS_PER_MINUTE, Settings


async def application(_scope, _receive, send) -> None:
    await send({"type": "http.response.start", "status": 200, "headers": []})


class Asking:
    def __init__(self, per_minute: int) -> None:
        self.quotas = Quotas(application, per_minute)

    def __call__(self, who: str = "a", path: str = "/api/v1/runs") -> tuple[int, dict[bytes, bytes]]:
        sent: list[dict] = []

        async def send(message: dict) -> None:
            sent.append(message)

        async def ask() -> None:
            caller.set(Caller(who))
            await self.quotas({"type": "http", "path": path, "headers": []}, None, send)

        asyncio.run(ask())
        self.body = sent[-1].get("body")
        return sent[0]["status"], dict(sent[0]["headers"])


def test_quotas_are_per_caller_and_recover_as_announced(monkeypatch):
    now = [1000.0]
    monkeypatch.setattr("time.time", lambda: now[0])
    monkeypatch.setattr(strategies.time, "time", lambda: now[0])
    ask = Asking(3)
    assert [ask()[0] for _ in range(3)] == [200] * 3
    now[0] += 20.0
    status, headers = ask()
    assert status == 429 and json.loads(ask.body)["title"] == "Too many requests"
    assert 39 <= int(headers[b"retry-after"]) <= 41
    assert ask("b")[0] == 200
    assert ask(path="/healthz")[0] == ask(path="/metrics")[0] == ask(path="/static/style.css")[0] == 200
    now[0] += int(headers[b"retry-after"]) - 1.5
    assert ask()[0] == 429
    now[0] += 1.6
    assert ask()[0] == 200


def test_loopback_has_no_default_quota():
    assert Settings().request_quota == 0
    assert Settings(host="0.0.0.0").request_quota == REQUESTS_PER_MINUTE
    assert Settings(host="0.0.0.0", requests_per_minute=0).request_quota == 0
    assert Settings(requests_per_minute=7).request_quota == 7


@pytest.mark.parametrize(
    ("address", "name"),
    [
        ("192.0.2.1", "192.0.2.1"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("2001:db8:1:2:ffff::1", "2001:db8:1:2::/64"),
        ("::ffff:192.0.2.1", "::ffff:192.0.2.1"),
        ("testclient", "testclient"),
    ],
)
def test_a_subscribers_addresses_are_one_caller(address, name):
    assert name_of_address(address) == name
