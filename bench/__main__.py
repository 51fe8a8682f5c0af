"""`make bench`: run the benchmarks and write their sections of docs/benchmarks.md.

python -m bench [SECTION ...]

Sections are named by the module that measures them; without names all are measured, each one after the other.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

from bench import (
    bulk,
    crank,
    design,
    effects,
    engine_overhead,
    influences,
    kernels,
    linkage,
    pin,
    random_designs,
    rod_problems,
    rod_tables,
    service,
    service_requests,
    start,
)
from bench.sections import put

PAGE = Path(__file__).parents[1] / "docs" / "benchmarks.md"
SECTIONS: dict[str, tuple[str, ModuleType]] = {
    "design": ("A design", design),
    "random_designs": ("Random problems", random_designs),
    "rod_problems": ("Realistic rods", rod_problems),
    "rod_tables": ("Rods under measured pressures", rod_tables),
    "kernels": ("The kernel that the general optimizers are given", kernels),
    "pin": ("The piston pin", pin),
    "linkage": ("The impact linkage", linkage),
    "crank": ("Crank dynamics", crank),
    "effects": ("Effects left out", effects),
    "influences": ("Influences of effects", influences),
    "bulk": ("Many at once", bulk),
    "engine_overhead": ("The engine of batches", engine_overhead),
    "service": ("The service", service),
    "service_requests": ("One request after another", service_requests),
    "start": ("The start", start),
}


def section(title: str, bench: ModuleType) -> list[str]:
    """Measure, and return the lines of the section."""
    method = re.split(r"\n\n *`?python -m ", (bench.__doc__ or "").partition("\n\n")[2])[0].strip()
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    when = (
        f"{datetime.now(UTC):%Y-%m-%d}: {platform.machine()}, {os.cpu_count()} cores, Python "
        f"{platform.python_version()}, {versions}."
    )
    return [f"## {title}", "", method, "", when, "", *bench.table(), ""]


def main() -> None:
    """Run the benches that are asked for and write their sections."""
    asked = argparse.ArgumentParser(prog="python -m bench", description="measure, and write docs/benchmarks.md")
    asked.add_argument("sections", nargs="*", metavar="SECTION", help=", ".join(SECTIONS))
    given = asked.parse_args().sections
    for unknown in set(given) - SECTIONS.keys():
        asked.error(f"there is no section {unknown}")
    for name in given or SECTIONS:
        title, bench = SECTIONS[name]
        lines = section(title, bench)
        put(PAGE, f"## {title}", lines)
        print("\n".join(lines), flush=True)


if __name__ == "__main__":
    main()
