"""`make bench`: run all benchmarks and write docs/benchmarks.md."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from bench import (
    bulk,
    crank,
    design,
    effects,
    influences,
    kernels,
    linkage,
    pin,
    random_designs,
    rod_problems,
    service,
    start,
)

PAGE = Path(__file__).parents[1] / "docs" / "benchmarks.md"


def main() -> None:
    """Run the benches and write the page."""
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    lines = [
        "# Benchmarks",
        "",
        f"Written by `make bench` on {datetime.now(UTC):%Y-%m-%d}: {platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, {versions}. Medians of one run; absolute times move with the machine, "
        "ratios less.",
        "",
    ]
    sections = (
        ("A design", design),
        ("Random problems", random_designs),
        ("A thousand realistic rods", rod_problems),
        ("The kernel that the general optimizers are given", kernels),
        ("The piston pin", pin),
        ("The impact linkage", linkage),
        ("Crank dynamics", crank),
        ("Effects left out", effects),
        ("Influences of effects", influences),
        ("Many at once", bulk),
    )
    for title, bench in sections:
        lines += [f"## {title}", "", bench.__doc__.partition("\n\n")[2].strip(), "", *bench.table(), ""]
    lines += ["## The service", "", service.__doc__.partition("\n\n")[2].strip(), "", *service.table(), ""]
    lines += start.section()
    PAGE.write_text("\n".join(lines), "utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
