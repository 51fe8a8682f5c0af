"""Measure error against time of every kind beside its peers; write docs/accuracy.md and its diagrams.

python -m bench.work_precision [CASES]
"""

from __future__ import annotations

import multiprocessing
import os
import platform
import sys
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from bench.work_precision import crank_dynamics, flexible_rod, impact_linkage, pin_profile
from bench.work_precision.curves import measure
from bench.work_precision.page import diagram, table

DOCS = Path(__file__).parents[2] / "docs"
CASES = 200
"""Of every kind, or as many as its reference allows."""
KINDS = {
    "flexible-rod": flexible_rod,
    "pin-profile": pin_profile,
    "impact-linkage": impact_linkage,
    "crank-dynamics": crank_dynamics,
}


def main(count: int = CASES) -> None:
    """Measure and write."""
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba", "cvxpy"))
    lines = [
        "# What accuracy costs",
        "",
        f"Written by `make bench` on {datetime.now(UTC):%Y-%m-%d}: {platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, {versions}. A quarter of the cases is hard. Absolute times move with the "
        "machine, ratios less. Any request of your own is put to the same question by `POST /api/v1/accuracy/{kind}`.",
        "",
    ]
    for slug, kind in KINDS.items():
        cases = kind.cases(min(count, kind.CASES))
        # References are nobody's time: they may use all processors, before anything is measured.
        with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
            exact = list(pool.map(kind.reference, cases, chunksize=4))
        curves = measure(list(kind.methods()), cases, exact)
        print(f"{kind.TITLE}: {len(cases)} cases", flush=True)
        (DOCS / f"accuracy-{slug}.svg").write_text(diagram(kind.TITLE, curves), "utf-8")
        lines += [f"## {kind.TITLE}", "", kind.__doc__.strip(), "", f"![{kind.TITLE}](accuracy-{slug}.svg)", ""]
        lines += [*table(curves), ""]
    (DOCS / "accuracy.md").write_text("\n".join(lines), "utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
