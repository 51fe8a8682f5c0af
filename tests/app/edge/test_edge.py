"""The middleware stack around a minimal application: limits at their values and one beyond."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route
from starlette.testclient import TestClient

from app.edge.bodies import BodyLimiter, BodyLimits
from app.edge.concurrency import ConcurrencyLimiter
from app.edge.hosts import host_name
from app.edge.stack import edge
from app.settings import Settings

SETTINGS = Settings(
    max_body_bytes=1000,
    max_batch_bytes=2000,
    max_head_bytes=2000,
    max_headers=20,
    allowed_hosts="a.example, testserver",
)


async def echo(request: Request) -> Response:
    if request.headers.get("content-type", "").startswith("multipart/"):
        async with request.form() as form:
            return PlainTextResponse(str(len(form)))
    return PlainTextResponse(str(len(await request.body())))


async def drawing(_request: Request) -> Response:
    return Response("<svg/>", media_type="image/svg+xml")


async def failing(_request: Request) -> Response:
    raise RuntimeError("a secret")


@pytest.fixture(scope="module")
def edged() -> Iterator[TestClient]:
    routes = [
        Route("/drawing", drawing),
        Route("/failing", failing),
        Route("/{rest:path}", echo, methods=["GET", "POST"]),
    ]
    with TestClient(edge(Starlette(routes=routes), SETTINGS, lambda: False), raise_server_exceptions=False) as client:
        yield client


def in_chunks(size: int) -> Iterator[bytes]:
    for _ in range(size // 100):
        yield b"x" * 100
    yield b"x" * (size % 100)


@pytest.mark.parametrize(("path", "limit"), [("/any", 1000), ("/api/v1/batches", 2000)])
@pytest.mark.parametrize("chunked", [False, True])
def test_the_size_of_a_body_is_limited_however_it_is_sent(edged, path, limit, chunked):
    for size, status in ((limit, 200), (limit + 1, 413)):
        answer = edged.post(path, content=in_chunks(size) if chunked else b"x" * size)
        assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["connection"] == "close"


@pytest.mark.parametrize(("coding", "status"), [("gzip", 415), ("zstd", 415), ("identity", 200)])
def test_a_compressed_body_is_refused(edged, coding, status):
    assert edged.post("/any", content=b"x", headers={"Content-Encoding": coding}).status_code == status


def test_a_multipart_body_has_the_same_limit(edged):
    def parts(size: int) -> Iterator[bytes]:
        yield b'--b\r\nContent-Disposition: form-data; name="f"; filename="f"\r\n\r\n'
        yield from in_chunks(size)
        yield b"\r\n--b--\r\n"

    form = {"Content-Type": "multipart/form-data; boundary=b"}
    assert edged.post("/", content=parts(500), headers=form).text == "1"
    assert edged.post("/", content=parts(100_000), headers=form).status_code == 413


def test_heads_are_limited(edged):
    own = len(edged.get("/").request.headers)
    for number, status in ((20 - own, 200), (21 - own, 431)):
        assert edged.get("/", headers={f"x-{k}": "y" for k in range(number)}).status_code == status
    assert edged.get("/", headers={"x-long": "y" * 2000}).status_code == 431
    assert edged.get("/" + "y" * 2000).status_code == 431


@pytest.mark.parametrize("target", ["/a%00b", "/?name=a%00b"])
def test_nul_characters_in_a_target_are_refused(edged, target):
    assert edged.get(target).status_code == (404 if "?" not in target else 422)


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("localhost", 200), ("localhost:8000", 200), ("LocalHost.", 200), ("127.0.0.1:1", 200), ("[::1]:80", 200),
        ("192.0.2.7", 200), ("a.example", 200), ("a.example:8000", 200),
        ("evil.example", 421), ("a.example.evil.example", 421), ("localhost.evil.example:80", 421), ("", 421),
        ("localhost:x", 421), ("127.0.0.1.evil.example", 421), ("a.example@evil.example", 421),
    ],
)  # fmt: skip
def test_unknown_hosts_are_refused(edged, host, status):
    answer = edged.get("/", headers={"Host": host})
    assert answer.status_code == status
    assert host in ("", "localhost:x") or host_name(host) is not None
    assert "evil" not in answer.text


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"Origin": "http://testserver"}, 200),
        ({"Origin": "http://testserver", "Sec-Fetch-Site": "same-origin"}, 200),
        ({"Sec-Fetch-Site": "none"}, 200),
        ({"Origin": "https://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://testserver.evil.example"}, 403),
        ({"Origin": "http://testserver:81"}, 403),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
        ({"Sec-Fetch-Site": "same-site"}, 403),
        ({"Origin": "http://testserver", "Sec-Fetch-Site": "cross-site"}, 403),
    ],
)
def test_unsafe_requests_of_other_sites_are_refused(edged, headers, status):
    assert edged.post("/", headers=headers).status_code == status
    assert edged.get("/", headers=headers).status_code == 200


@pytest.mark.parametrize("path", ["/", "/drawing", "/failing", "/?name=%00"])
def test_every_response_has_security_headers(edged, path):
    headers = edged.get(path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert "default-src 'none'" in headers["content-security-policy"]
    assert ("sandbox" in headers["content-security-policy"]) == (path == "/drawing")


def asked(app, path: str = "/", receive=None) -> list[dict]:
    """The messages an ASGI application sends."""
    sent: list[dict] = []

    async def nothing() -> dict:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message: dict) -> None:
        sent.append(message)

    scope = {"type": "http", "method": "POST", "path": path, "query_string": b"", "headers": []}
    asyncio.run(app(scope, receive or nothing, send))
    return sent


async def reader(_scope, receive, send) -> None:
    """Reads a complete body, and fails without one."""
    while True:
        message = await receive()
        if message["type"] == "http.disconnect":
            raise RuntimeError("the client is gone")
        if not message["more_body"]:
            break
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b""})


def slow(pause: float, size: int, parts: int):
    left = iter(range(parts))

    async def receive() -> dict:
        await asyncio.sleep(pause)
        return {"type": "http.request", "body": b"x" * size, "more_body": next(left, None) is not None}

    return receive


@pytest.mark.parametrize(
    ("pause", "size", "parts", "stopping", "status"),
    [
        (0.01, 1, 2, False, 200),
        (0.4, 1, 2, False, 408),  # pauses longer than it may
        (0.05, 1, 20, False, 408),  # trickles
        (0.05, 200, 6, False, 200),  # as slow, but enough of it
        (9.0, 1, 2, True, 503),
    ],
)
def test_slow_bodies_time_out(pause, size, parts, stopping, status):
    limits = BodyLimits(10_000, idle_s=9.0 if stopping else 0.2, grace_s=0.1, min_bytes_per_s=1000.0)
    sent = asked(BodyLimiter(reader, limits, lambda: stopping), receive=slow(pause, size, parts))
    assert [message["status"] for message in sent if message["type"] == "http.response.start"] == [status]


def test_time_in_which_the_application_does_not_read_is_not_counted():
    """Before it reads the rows of a batch the service may have to load kernels."""

    async def busy(scope, receive, send) -> None:
        await asyncio.sleep(0.3)
        await reader(scope, receive, send)

    limits = BodyLimits(10_000, idle_s=0.2, grace_s=0.1, min_bytes_per_s=1000.0)
    sent = asked(BodyLimiter(busy, limits, lambda: False), receive=slow(0.0, 1, 3))
    assert [message["status"] for message in sent if message["type"] == "http.response.start"] == [200]


def test_concurrent_requests_are_limited():
    async def waiting(_scope, _receive, send) -> None:
        await asyncio.sleep(0.05)
        await send({"type": "http.response.start", "status": 200, "headers": []})

    crowd, statuses = ConcurrencyLimiter(waiting, 3), []

    async def send(message: dict) -> None:
        if message["type"] == "http.response.start":
            statuses.append(message["status"])

    async def all_at_once() -> None:
        scopes = [{"type": "http", "path": path, "headers": []} for path in ("/a", "/a", "/a", "/a", "/healthz")]
        await asyncio.gather(*(crowd(scope, None, send) for scope in scopes))
        await crowd(scopes[0], None, send)

    asyncio.run(all_at_once())
    assert sorted(statuses) == [200, 200, 200, 200, 200, 503]
