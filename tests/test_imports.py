"""What an import brings along: the compiler, solvers of cones and pictures come when they are used, not before."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

COMPILER = {"numba", "llvmlite"}
NUMERICS = {"scipy", "cvxpy", "mpmath", "clarabel"}
STORE = {"alembic", "mako"}
OTHERS = {"ezdxf", "build123d", "OCP", "typst", "matplotlib", "pandas", "openmdao", "httpx", "playwright", "IPython"}
WEB = {"fastapi", "starlette", "uvicorn", "sqlalchemy", "pydantic", "numpy"}


def imported(code: str) -> set[str]:
    """The packages that are loaded after the code has run."""
    told = f"{code}; import sys; print(*sorted({{name.partition('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, cwd=ROOT, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize(
    ("code", "unwanted"),
    [
        ("import solvers", COMPILER | NUMERICS | STORE | OTHERS | WEB),
        ("from solvers import rod, pin, linkage, crank", COMPILER | NUMERICS | STORE | OTHERS | WEB - {"numpy"}),
        ("import app.cli", COMPILER | NUMERICS | STORE | OTHERS | WEB),
        ("import app.jobs.template", COMPILER | NUMERICS | STORE | OTHERS | WEB),
        ("import app.main", COMPILER | NUMERICS | STORE | OTHERS),
    ],
    ids=["solvers", "wings", "cli", "template", "main"],
)
def test_an_import_brings_nothing_that_is_not_needed(code: str, unwanted: set[str]) -> None:
    assert not imported(code) & unwanted
