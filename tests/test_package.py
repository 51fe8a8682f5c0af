"""What `pip install .` installs: the whole service, away from the checkout."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The distribution installed into a separate folder, without its dependencies."""
    folder = tmp_path_factory.mktemp("installed")
    # As scripts/install: by uv where that could be had, which leaves the environment without pip.
    own = Path(sys.executable).with_name("uv")
    uv = str(own) if own.exists() else shutil.which("uv")
    pip = [uv, "pip"] if uv else [sys.executable, "-m", "pip"]
    whose = ["--python", sys.executable] if uv else []
    command = [*pip, "install", *whose, "--quiet", "--no-deps", "--target", str(folder), str(ROOT)]
    subprocess.run(command, check=True, timeout=120)
    return folder


def python(installed: Path, *arguments: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(installed), "PYTHONSAFEPATH": "1"}
    done = subprocess.run(
        [sys.executable, *arguments], env=environment, cwd=installed, capture_output=True, text=True, timeout=170
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_it_carries_pages_examples_and_migrations(installed):
    code = "import app, solvers, migrations; print(app.__file__, solvers.__file__, migrations.__file__)"
    assert python(installed, "-c", code).count(str(installed)) == 3
    for folder in ("app/web/templates", "app/web/static", "app/designs/examples", "migrations/versions"):
        there = {p.relative_to(ROOT) for p in (ROOT / folder).glob("*.*")}
        assert there
        assert all((installed / path).exists() for path in there), folder


def test_it_excludes_tests_benches_and_oracles(installed):
    assert not [name for name in ("oracles", "bench", "tests") if (installed / name).exists()]


def test_its_command_checks_and_stores(installed, tmp_path):
    """The kernels that this check needs are compiled anew, next to the installed modules."""
    request = tmp_path / "request.json"
    request.write_text(json.dumps(KINDS["pin-profile"].example(Mode.CHECK)))
    out = python(
        installed, "-m", "app.cli", "check", "pin-profile", str(request), "--json",
        "--database-url", f"sqlite:///{tmp_path}/runs.sqlite3",
    )  # fmt: skip
    assert json.loads(out)["status"] == "succeeded"
    assert list((installed / "solvers").rglob("*.nbi"))
    assert (installed / "bin" / "crankwright").exists()


def locked(name: str) -> dict[str, str]:
    """The entries of a lock file by distribution."""
    entries = re.split(r"\n(?=[a-z0-9])", (ROOT / name).read_text())
    return {re.split(r"[=\[ ]", entry, maxsplit=1)[0]: entry for entry in entries}


def test_every_dependency_is_locked_with_hashes_and_in_one_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    service, development = locked("requirements.lock"), locked("requirements-dev.lock")
    wanted = [re.split(r"[>=\[ ]", item, maxsplit=1)[0] for item in project["dependencies"]]
    extras = [
        re.split(r"[>=\[ ]", item, maxsplit=1)[0]
        for group in project["optional-dependencies"].values()
        for item in group
    ]
    assert set(wanted) <= set(service)
    assert {*wanted, *extras} <= set(development)
    assert all("--hash=sha256:" in entry for entry in [*service.values(), *development.values()])
    assert {e.partition(" ")[0] for e in service.values()} <= {e.partition(" ")[0] for e in development.values()}
