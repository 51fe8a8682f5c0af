"""What a client has already is not sent again."""

from __future__ import annotations

import pytest
from starlette.testclient import TestClient

from app.designs.kind import Mode
from app.designs.registry import KINDS
from tests.app.serving import file_at


@pytest.fixture(scope="module")
def run(client: TestClient) -> dict:
    return client.post("/api/v1/checks/pin-profile", json=KINDS["pin-profile"].example(Mode.CHECK)).json()


@pytest.mark.parametrize("link", ["self", "csv", "svg", "dxf", "html", "stress"])
def test_a_run_and_its_files_are_sent_once(client: TestClient, run: dict, link: str) -> None:
    links = {**run["links"], **run["links"]["exports"], **run["links"]["plots"]}
    plain = {"accept-encoding": "identity"}
    first = file_at(client, links[link], headers=plain)
    tag = first.headers["etag"]
    assert first.status_code == 200 and tag.startswith('"')
    for asked in (tag, f'"other", {tag}', f"W/{tag}", "*"):
        again = client.get(links[link], headers={**plain, "if-none-match": asked})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag)
        assert again.headers["cache-control"] == first.headers["cache-control"]
    assert client.get(links[link], headers={**plain, "if-none-match": '"other"'}).content == first.content


def test_a_compressed_answer_has_a_weak_tag(client: TestClient, run: dict) -> None:
    """Its bytes are not those of the plain one."""
    packed = client.get(run["links"]["self"], headers={"accept-encoding": "gzip"})
    assert packed.headers["content-encoding"] == "gzip" and packed.headers["etag"].startswith('W/"')
    headers = {"accept-encoding": "gzip", "if-none-match": packed.headers["etag"]}
    assert client.get(run["links"]["self"], headers=headers).status_code == 304


def test_another_answer_has_another_tag(client: TestClient, run: dict) -> None:
    other = client.post("/api/v1/checks/pin-profile", json=KINDS["pin-profile"].example(Mode.CHECK)).json()
    tags = {client.get(each["links"]["self"]).headers["etag"] for each in (run, other)}
    assert len(tags) == 2
