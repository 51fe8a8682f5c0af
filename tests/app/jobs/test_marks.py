"""A mark is believed as long as what it speaks for is there."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.jobs import marks
from solvers.rod.strip.buckling import first_root

PART = ("pin-profile", "check")


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(marks, "_places", lambda: (tmp_path / "nowhere" / "here", tmp_path))


def test_a_mark_is_not_believed_once_a_kernel_is_gone(tmp_path: Path) -> None:
    there = [tmp_path / "a.nbi", tmp_path / "a.1.nbc"]
    for file in there:
        file.touch()
    assert not marks.is_left(PART)
    marks.leave(PART, there)
    assert marks.is_left(PART)
    there[1].unlink()
    assert not marks.is_left(PART)
    assert not marks.is_left(("pin-profile", "design"))


def test_a_kernel_knows_its_files() -> None:
    first_root(0.4)
    assert {file.suffix for file in first_root.files} == {".nbi", ".nbc"}
    assert all(file.name.startswith("buckling.first_root-") for file in first_root.files)
