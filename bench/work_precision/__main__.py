"""Measure error against time of every kind and its peers; write docs/accuracy.md and its diagrams.

python -m bench.work_precision [--cases N] [KIND ...]

Sections of other kinds are left unchanged.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import platform
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

# before importing numpy: times are processor times of a single thread
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from bench.work_precision import crank_dynamics, flexible_rod, flexible_rod_effects, impact_linkage, pin_profile
from bench.work_precision.curves import measure
from bench.work_precision.page import diagram, table, written

DOCS = Path(__file__).parents[2] / "docs"
CASES = 200
"""Number of cases per kind, limited by what its reference allows."""
KINDS: dict[str, ModuleType] = {
    "flexible-rod": flexible_rod,
    "flexible-rod-effects": flexible_rod_effects,
    "pin-profile": pin_profile,
    "impact-linkage": impact_linkage,
    "crank-dynamics": crank_dynamics,
}
HEAD = """# What accuracy costs

Written by `make bench`, every section on the day that it names; `python -m bench.work_precision KIND` measures one
again. A quarter of the cases is hard, where a section does not say otherwise. Absolute times move with the machine,
ratios less; goals are medians on one idle core. Any request of your own is put to the same question by
`POST /api/v1/accuracy/{kind}`.
"""


def section(slug: str, count: int) -> str:
    """Measure a kind over ``count`` cases, write its diagram and return its section."""
    kind = KINDS[slug]
    cases = kind.cases(min(count, kind.CASES))
    # References are not timed and may use all processors, before measurements start.
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        exact = list(pool.map(kind.reference, cases, chunksize=4))
    curves = measure(list(kind.methods()), cases, exact)
    (DOCS / f"accuracy-{slug}.svg").write_text(diagram(kind.TITLE, curves), "utf-8")
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba", "cvxpy"))
    lines = [f"## {kind.TITLE}", "", kind.__doc__.strip(), ""]
    lines += [*kind.remarks(cases), ""] if hasattr(kind, "remarks") else []
    lines += [
        f"{datetime.now(UTC):%Y-%m-%d}: {len(cases)} cases, processor time of one thread, {platform.machine()}, Python "
        f"{platform.python_version()}, {versions}.",
        "",
        f"![{kind.TITLE}](accuracy-{slug}.svg)",
        "",
        *table(curves),
    ]
    return "\n".join(lines)


def main() -> None:
    """Run the measurements and write the page."""
    asked = argparse.ArgumentParser(prog="python -m bench.work_precision", description="error against time")
    asked.add_argument("--cases", type=int, default=CASES, help="of each kind, at most")
    asked.add_argument("kinds", nargs="*", default=list(KINDS), metavar="KIND", help=", ".join(KINDS))
    given = asked.parse_args()
    for unknown in set(given.kinds) - KINDS.keys():
        asked.error(f"there is no kind {unknown}")
    page = DOCS / "accuracy.md"
    for slug in given.kinds:
        found = {KINDS[slug].TITLE: section(slug, given.cases)}
        order = [kind.TITLE for kind in KINDS.values()]
        page.write_text(written(page.read_text("utf-8") if page.exists() else "", HEAD, order, found), "utf-8")
        print(found[KINDS[slug].TITLE], flush=True)


if __name__ == "__main__":
    main()
