"""A full temporary directory is said to be one."""

from __future__ import annotations

import tempfile
from contextlib import contextmanager
from pathlib import Path

import pytest
from starlette.testclient import TestClient

PLACE = "?kind=pin-profile&mode=check"


def test_a_parquet_file_without_room_is_507(
    client: TestClient, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @contextmanager
    def full(**_: object):
        (tmp_path / "batch.parquet").symlink_to("/dev/full")
        yield str(tmp_path)

    monkeypatch.setattr(tempfile, "TemporaryDirectory", full)
    headers = {"Content-Type": "application/vnd.apache.parquet"}
    answer = client.post("/api/v1/batches" + PLACE, content=b"x" * 100_000, headers=headers)
    assert answer.status_code == 507 and answer.json()["title"] == "The disk is full"


def test_an_upload_without_room_is_507_on_a_page(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(**_: object):
        return Path("/dev/full").open("w+b", buffering=0)

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    cases = {"cases": ("cases.csv", b"load.force_n\n" + b"1.0\n" * 600_000)}
    asked = {"kind": "pin-profile", "mode": "check"}
    answer = client.post("/batches/upload", files=cases, data=asked, headers={"Accept": "text/html"})
    assert answer.status_code == 507 and "<html" in answer.text and "no room" in answer.text
