"""Connection limits on a real socket."""

from __future__ import annotations

import asyncio
import socket
import sys
import threading
import time
from collections.abc import Iterator

import pytest
import uvicorn

from app.edge.connections import ConnectionLimits, Connections

LIMITS = ConnectionLimits(limit=8, max_per_address=6, head_s=0.5, head_bytes=4000, unread_s=0.5)
ASKED = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"


async def application(scope, receive, send) -> None:
    while (await receive()).get("more_body") and scope["path"] != "/refused":
        pass
    large = b"x" * (20_000_000 if scope["path"] == "/large" else 2)
    length = str(len(large)).encode()
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", length)]})
    if scope["path"] == "/later":
        await asyncio.sleep(1.0)
    await send({"type": "http.response.body", "body": large})


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    connections = Connections(LIMITS)
    config = uvicorn.Config(
        application, port=0, lifespan="off", log_config=None, http=connections.protocol(), timeout_keep_alive=1
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=lambda: asyncio.run(server.serve()), daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield server.servers[0].sockets[0].getsockname()[1]
    server.should_exit = True
    thread.join()
    assert not connections.count_by_address


def connected(port: int, source: str = "127.0.0.1") -> socket.socket:
    connection = socket.create_connection(("127.0.0.1", port), source_address=(source, 0))
    connection.settimeout(10)
    return connection


def rest_of(connection: socket.socket) -> bytes:
    """Everything received until the server closes."""
    found = b""
    try:
        while part := connection.recv(65536):
            found += part
    except ConnectionResetError:
        pass
    return found


@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\nHost: loc", b"\r\n", ASKED + b"GET / HT", ASKED + b"\r\n"])
def test_a_head_must_arrive_in_time(port, sent):
    with connected(port) as connection:
        began = time.monotonic()
        connection.sendall(sent)
        detail = rest_of(connection)
        assert time.monotonic() - began < 5.0
        assert (b"HTTP/1.1 408" in detail) == (sent.endswith(b"loc"))


def test_a_trickling_head_times_out(port):
    with connected(port) as connection:
        began = time.monotonic()
        connection.sendall(b"GET / HTTP/1.1\r\n")
        try:
            while time.monotonic() - began < 5.0:
                connection.sendall(b"x-a: b\r\n")
                time.sleep(0.05)
        except OSError:
            pass
        assert time.monotonic() - began < 4.0


def test_the_size_of_a_head_is_limited(port):
    with connected(port) as connection:
        sent = 0
        connection.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nx-long: ")
        try:
            while sent < 50_000_000:
                sent += connection.send(b"y" * 100_000)
        except OSError:
            pass
        assert sent < 20_000_000


def test_trailers_are_dropped_and_limited(port):
    head = b"POST / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n1\r\nx\r\n0\r\nx-trailer: "
    with connected(port) as connection:
        connection.sendall(head)
        time.sleep(0.1)
        connection.sendall(b"y" * 100_000)
        assert b"HTTP/1.1 400" in rest_of(connection)
    with connected(port) as connection:
        connection.sendall(head + b"y\r\n\r\n")
        assert connection.recv(1000).startswith(b"HTTP/1.1 200")


def test_bodies_in_the_smallest_chunks_pass(port):
    with connected(port) as connection:
        head = b"POST / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"
        connection.sendall(head)
        for _ in range(20):
            connection.sendall(b"1\r\nx\r\n" * 1000)
        connection.sendall(b"0\r\n\r\n")
        assert connection.recv(1000).startswith(b"HTTP/1.1 200")


@pytest.mark.parametrize("rest", [b"x" * 8_000_000, b"x" * 9_000_000 + ASKED], ids=["unfinished", "with more"])
def test_a_refusal_is_heard_after_more_of_the_body_is_sent(port, rest):
    with connected(port) as connection:
        head = b"POST /refused HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: 10000000\r\n\r\n"
        connection.sendall(head + b"x" * 1_000_000)
        time.sleep(0.1)
        connection.sendall(rest)
        assert rest_of(connection).count(b"HTTP/1.1 200") == 1


def test_an_unread_response_times_out(port):
    with connected(port) as connection:
        connection.sendall(b"GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n")
        time.sleep(1.5)
        assert len(rest_of(connection)) < 20_000_000


def test_a_head_arrives_with_its_body_or_before_a_later_one(port):
    with connected(port) as connection:
        connection.sendall(ASKED)
        assert connection.recv(1000).endswith(b"\r\n\r\nxx")
        connection.sendall(ASKED.replace(b"/ ", b"/later "))
        began = time.monotonic()
        assert connection.recv(1000).endswith(b"\r\n\r\n")
        assert time.monotonic() - began < 0.9
        assert connection.recv(1000) == b"xx"


def test_pipelined_requests_are_each_answered(port):
    with connected(port) as connection:
        later, last = (
            ASKED.replace(*change, 1) for change in ((b"/", b"/later"), (b"\r\n", b"\r\nConnection: close\r\n"))
        )
        connection.sendall(ASKED + later + ASKED + last)
        heads_and_bodies = rest_of(connection).split(b"HTTP/1.1 200 OK\r\n")
        assert len(heads_and_bodies) == 5
        assert all(answer.endswith(b"\r\n\r\nxx") for answer in heads_and_bodies[1:])


def test_connections_per_address_are_limited(port):
    held = [connected(port) for _ in range(LIMITS.max_per_address)]
    with connected(port) as one_more:
        assert b"503" in rest_of(one_more)
    for connection in held:
        connection.sendall(ASKED)
        assert connection.recv(1000).startswith(b"HTTP/1.1 200")
        connection.close()
    time.sleep(0.1)
    with connected(port) as again:
        again.sendall(ASKED)
        assert again.recv(1000).startswith(b"HTTP/1.1 200")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere 127.0.0.2 is nobody")
def test_total_connections_are_limited(port):
    sources = ["127.0.0.1"] * 6 + ["127.0.0.2"] * (LIMITS.limit - 6)
    held = [connected(port, source) for source in sources]
    for connection in held:
        connection.sendall(ASKED)
        assert connection.recv(1000).startswith(b"HTTP/1.1 200")
    with connected(port, "127.0.0.3") as one_more:
        assert b"503" in rest_of(one_more)
    for connection in held:
        connection.close()
    time.sleep(0.1)
