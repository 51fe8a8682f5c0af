"""A marker is valid as long as the cache files it lists exist."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.jobs import warm_markers
from solvers.rod.strip.buckling import first_root

PART = ("pin-profile", "check")


@pytest.fixture(autouse=True)
def temporary_directories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warm_markers, "_directories", lambda: (tmp_path / "nowhere" / "here", tmp_path))


def test_a_marker_is_invalid_once_a_kernel_is_missing(tmp_path: Path) -> None:
    there = [tmp_path / "a.nbi", tmp_path / "a.1.nbc"]
    for file in there:
        file.touch()
    assert not warm_markers.exists(PART)
    warm_markers.write(PART, there)
    assert warm_markers.exists(PART)
    there[1].unlink()
    assert not warm_markers.exists(PART)
    assert not warm_markers.exists(("pin-profile", "design"))


def test_a_kernel_knows_its_files() -> None:
    first_root(0.4)
    assert {file.suffix for file in first_root.files} == {".nbi", ".nbc"}
    assert all(file.name.startswith("buckling.first_root-") for file in first_root.files)
