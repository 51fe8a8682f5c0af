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
MOST_MODULES = 1250
"""Maximum number of modules of a check on the command line, of which numba and numpy are three hundred."""
WEB = {"fastapi", "starlette", "uvicorn", "sqlalchemy", "pydantic", "numpy"}


def modules(code: str, *arguments: str) -> set[str]:
    """The modules that are loaded after the code has run."""
    told = f"{code}\nimport sys; print('', *sys.modules, sep=chr(10))"
    command = [sys.executable, "-c", told, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True)
    return set(done.stdout.split())


def imported(code: str) -> set[str]:
    """The packages that are loaded after the code has run."""
    return {name.partition(".")[0] for name in modules(code)}


@pytest.mark.parametrize(
    ("code", "unwanted"),
    [
        ("import solvers", COMPILER | NUMERICS | STORE | OTHERS | WEB),
        ("from solvers import rod, pin, linkage, crank", COMPILER | NUMERICS | STORE | OTHERS | WEB - {"numpy"}),
        ("import app.cli", COMPILER | NUMERICS | STORE | OTHERS | WEB),
        ("import app.jobs.fork_server", COMPILER | NUMERICS | STORE | OTHERS | WEB),
        ("import app.main", COMPILER | NUMERICS | STORE | OTHERS),
    ],
    ids=["solvers", "wings", "cli", "template", "main"],
)
def test_imports_are_minimal(code: str, unwanted: set[str]) -> None:
    assert not imported(code) & unwanted


def test_idle_workers_import_the_libraries_of_exports() -> None:
    idle = "from app.jobs import calls, warm_markers; warm_markers.exists = lambda part: False"
    loaded = imported(f"{idle}; [*calls.load_step_by_step()]")
    assert {"ezdxf", "typst"} <= loaded
    assert not {"build123d", "OCP"} & loaded


def test_a_kind_imports_no_other() -> None:
    loaded = modules("from app.designs.registry import KINDS; KINDS['pin-profile']")
    assert "solvers.pin.check" in loaded
    assert not {"solvers.rod.check", "solvers.linkage.check", "app.designs.flexible_rod.kind"} & loaded


CHECK = """
from app.cli import main
try:
    main()
except SystemExit as ended:
    assert ended.code == 0
"""


def test_a_command_line_check_imports_neither_other_kinds_nor_the_compiler(tmp_path: Path) -> None:
    """Neither what numba compiles by nor what serves; the budget is for packages to come, which take time as well."""
    file = str(ROOT / "app/designs/examples/pin-profile-check.json")
    command = ("check", "pin-profile", file, "--database-url", f"sqlite:///{tmp_path}/runs.sqlite3")
    modules(CHECK, *command)  # the database is made, and kernels are there
    loaded = modules(CHECK, *command)
    compiler, serving = {"numba.typed.dictimpl"}, {"fastapi", "starlette", "uvicorn", "prometheus_client", "structlog"}
    stores = {"alembic", "sqlalchemy.dialects.postgresql"}
    assert not (compiler | serving | stores | {"solvers.rod.check", "app.jobs.executor"}) & loaded
    assert len(loaded) < MOST_MODULES
