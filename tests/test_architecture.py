"""Import rules of the architecture, checked in the source code."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILES = sorted(path for package in ("solvers", "app") for path in (ROOT / package).rglob("*.py"))


def module(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


@cache
def imports(path: Path) -> set[str]:
    """Modules a file imports anywhere, those for its annotations too."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
    return found


def top_levels(path: Path) -> set[str]:
    return {name.partition(".")[0] for name in imports(path)}


@pytest.mark.parametrize("path", [p for p in FILES if p.is_relative_to(ROOT / "solvers")], ids=module)
def test_solvers_know_nothing_of_the_service(path):
    assert not top_levels(path) & {"app", "migrations", "fastapi", "starlette", "pydantic", "sqlalchemy", "alembic"}


def test_the_service_does_not_import_oracles_benches_or_tests():
    for path in FILES:
        assert not top_levels(path) & {"oracles", "bench", "tests"}, module(path)
    for path in (ROOT / "oracles").rglob("*.py"):
        assert not top_levels(path) & {"app", "bench", "tests"}, module(path)


_EDGE = ("app.api", "app.web", "app.cli", "app.main")
WINGS = ("solvers.rod", "solvers.pin", "solvers.linkage", "solvers.crank")

ABOVE = {
    "solvers.numerics": (*WINGS, "solvers.effects", "solvers.outcome", "solvers.accuracy"),
    "solvers.errors": (*WINGS, "solvers.numerics", "solvers.effects", "solvers.outcome", "solvers.accuracy"),
    "solvers.outcome": (*WINGS, "solvers.numerics", "solvers.effects", "solvers.accuracy", "solvers.verdict"),
    "solvers.effects": (*WINGS, "solvers.accuracy"),
    "solvers.verdict": (*WINGS, "solvers.accuracy", "solvers.effects", "solvers.numerics"),
    "solvers.accuracy": WINGS,
    "solvers.materials": WINGS,
    "solvers.fatigue": WINGS,
    "solvers.crank": ("solvers.rod", "solvers.pin", "solvers.linkage"),
    "solvers.pin": ("solvers.rod", "solvers.crank", "solvers.linkage"),
    "app.logging": ("app.designs", "app.store", "app.jobs", "app.submission", "app.settings", *_EDGE),
    "app.words": ("app.store", "app.jobs", "app.exports", "app.reports", "app.submission", "app.run_exports", *_EDGE),
    "app.reports": ("app.store", "app.jobs", "app.exports", "app.submission", "app.run_exports", *_EDGE),
    "app.designs": (
        "app.words",
        "app.reports",
        "app.store",
        "app.jobs",
        "app.exports",
        "app.submission",
        "app.run_exports",
        "app.batches",
        "app.settings",
        *_EDGE,
    ),
    "app.store": (
        "app.designs",
        "app.jobs",
        "app.exports",
        "app.submission",
        "app.run_exports",
        "app.batches",
        *_EDGE,
        "solvers",
    ),
    "app.exports": ("app.store", "app.jobs", "app.runs", "app.submission", "app.run_exports", "app.batches", *_EDGE),
    "app.jobs": ("app.store", "app.submission", "app.run_exports", "app.batches", *_EDGE),
    "app.batches": ("app.submission", "app.run_exports", *_EDGE),
    "app.submission": _EDGE,
    "app.run_exports": _EDGE,
    "app.api": ("app.web", "app.cli", "app.main"),
    "app.web": ("app.cli", "app.main"),
}
"""Modules above each package or module, which it must not import."""


@pytest.mark.parametrize(("lower", "above"), ABOVE.items(), ids=ABOVE)
def test_no_import_points_upward(lower, above):
    for path in FILES:
        if module(path) == lower or module(path).startswith(lower + "."):
            bad = {name for name in imports(path) for upper in above if name == upper or name.startswith(upper + ".")}
            assert not bad, f"{module(path)} imports {sorted(bad)}"


ROOMS = {
    "solvers/rod": (
        "scene", "load", "strip", "piston", "cycle", "vibration", "linear_check", "influences", "effects", "check",
        "bulk", "rows", "objectives", "constraints", "problem", "verdict", "optimum", "design",
    ),
    "solvers/rod/optimum": (
        "sizes", "rows_at_samples", "peak_positions", "peaks", "sqp", "sensitivities", "core", "proof", "full_model",
        "search", "answer", "strip_search",
    ),
    "solvers/linkage": (
        "mechanism", "scene", "limits", "loads", "swept_area", "steady_state", "result", "constraints", "effects",
        "warnings", "check", "bulk", "verdict", "problem", "optimum", "design", "pareto_front",
    ),
    "solvers/crank": (
        "motion", "masses", "gas", "scene", "cycle", "engine", "effects", "check", "bulk",
    ),
    "solvers/pin": (
        "load", "scene", "materials", "stations", "section", "ring", "effects", "optimum",
        "shapes", "problem", "result", "warnings", "closed_form", "check", "bulk", "verdict", "design",
    ),
}  # fmt: skip
"""The rooms of a wing, or of a large room, in the order in which the data flows: each may import those before it."""


def arrows(wing: str) -> set[tuple[str, str]]:
    """(room, other room) for every import between the rooms of a wing; a room is a file or a folder."""
    found, place = set(), wing.split("/")
    for path in (ROOT / wing).rglob("*.py"):
        room = path.relative_to(ROOT / wing).with_suffix("").parts[0]
        names = [name.split(".") for name in imports(path)]
        others = {parts[len(place)] for parts in names if parts[: len(place)] == place and len(parts) > len(place)}
        found |= {(room, other) for other in others if room not in (other, "__init__")}
    return found


@pytest.mark.parametrize(("wing", "order"), ROOMS.items(), ids=ROOMS)
def test_rooms_follow_the_data(wing, order):
    rooms = {path.stem for path in (ROOT / wing).iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
    assert rooms - {"__init__"} == set(order)
    place = {room: number for number, room in enumerate(order)}
    assert not {(room, other) for room, other in arrows(wing) if place.get(other, 0) > place[room]}


def test_no_circles():
    known = {module(path): path for path in FILES}
    graph = {name: imports(path) & known.keys() - {name} for name, path in known.items()}
    done: set[str] = set()

    def walk(name: str, trail: tuple[str, ...]) -> None:
        assert name not in trail, " -> ".join((*trail, name))
        if name not in done:
            for other in graph[name]:
                # A package's face hands on its rooms; the rooms do not go through it.
                if not name.startswith(other + "."):
                    walk(other, (*trail, name))
            done.add(name)

    for name in graph:
        walk(name, ())


def test_all_sql_lives_in_the_store():
    for path in FILES:
        if not path.is_relative_to(ROOT / "app" / "store"):
            assert "sqlalchemy" not in top_levels(path), module(path)


def test_every_wing_has_the_same_rooms():
    of_all = {"scene.py", "effects.py", "check.py", "bulk.py"}
    assert of_all <= {path.name for path in (ROOT / "solvers" / "crank").iterdir()}
    rooms = of_all | {"design.py", "verdict.py"}
    for wing in ("rod", "pin", "linkage"):
        assert rooms <= {path.name for path in (ROOT / "solvers" / wing).iterdir()}, wing


def test_files_stay_readable():
    long = {module(path): n for path in FILES if (n := len(path.read_text("utf-8").splitlines())) > 450}
    assert not long


def test_rows_are_fetched_before_they_are_decoded():
    """What fails between two rows would leave the statement open, and its connection in the state of that moment. Only
    the verification, which is done with its connection, reads row by row."""
    found = []
    for path in (ROOT / "app" / "store").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))) if "verify" not in path.name else ():
            if isinstance(node, (ast.For, ast.comprehension)):
                steps = [step.attr for step in ast.walk(node.iter) if isinstance(step, ast.Attribute)]
                if "execute" in steps and "all" not in steps:
                    found.append(f"{path.name}: {ast.unparse(node.iter)}")
    assert not found
