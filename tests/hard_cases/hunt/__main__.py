"""``python -m tests.hard_cases.hunt WING|all SECONDS [SEED]``: search, print the worst cases, and store those worth
keeping."""

from __future__ import annotations

import sys
import time

from tests.hard_cases import (
    cases,
    make_crank_references,
    make_linkage_references,
    make_pin_references,
    make_rod_references,
)
from tests.hard_cases.hunt import crank, linkage, log, pin, rod
from tests.hard_cases.hunt.quarry import Quarry
from tests.hard_cases.hunt.search import Bag, Find, search

QUARRIES = {"rod": rod.QUARRIES, "crank": crank.QUARRIES, "pin": pin.QUARRIES, "linkage": linkage.QUARRIES}
MAKERS = {
    "rod": make_rod_references.main,
    "crank": make_crank_references.main,
    "pin": make_pin_references.main,
    "linkage": make_linkage_references.main,
}
THRESHOLD = 30.0
"""Error [eps max(1, kappa)] above which finds are kept, up to MOST of them; below it only the worst one is. A find is
only kept if it is worse than those kept before."""
MOST = 3
SHOWN = 5


def worth_keeping(quarry: Quarry, bag: Bag, data: dict) -> list[Find]:
    before = max((case.get("units", 0.0) for case in found_before(quarry, data)), default=0.0)
    beyond = [find for find in bag.finds if find.units > max(THRESHOLD, before)][:MOST]
    return beyond or [find for find in bag.finds[:1] if find.units > before]


def found_before(quarry: Quarry, data: dict) -> list[dict]:
    return [case for case in data[quarry.group] if case["name"].startswith(f"found_{quarry.stem}_")]


def keep(quarry: Quarry, bag: Bag) -> list[str]:
    """Add finds to the wing's cases and generate their references; returns their names."""
    data, names = cases.read(quarry.wing), []
    for find in worth_keeping(quarry, bag, data):
        name = f"found_{quarry.stem}_{len(found_before(quarry, data)) + 1}"
        why = f"the hunt's worst of {bag.scenes:,} scenes: {find.units:.2g} ε max(1, κ) in {find.value}"
        data[quarry.group].append({"name": name, "why": why, "units": round(find.units, 3), **find.case})
        names.append(name)
    if names:
        cases.write(quarry.wing, data)
        MAKERS[quarry.wing](names)
    return names


def hunt(quarry: Quarry, seconds: float, seed: int) -> None:
    started = time.perf_counter()
    bag = search(quarry, seed, seconds)
    print(f"{quarry.wing}, {quarry.stem}: {bag.scenes} scenes in {time.perf_counter() - started:.0f} s")
    if not bag.finds:
        return
    for find in bag.finds[:SHOWN]:
        print(f"  {find.units:9.3g} in {find.value}: {find.case}")
    worst = bag.finds[0]
    log.note(quarry.wing, quarry.stem, {
        "seed": seed,
        "scenes": bag.scenes,
        "median": bag.finds[bag.scenes // 2].units,
        "worst": worst.units,
        "value": worst.value,
        "kept": keep(quarry, bag),
    })  # fmt: skip


def main(wing: str, seconds: float, seed: int) -> None:
    quarries = [q for name in (QUARRIES if wing == "all" else [wing]) for q in QUARRIES[name]]
    for quarry in quarries:
        hunt(quarry, seconds / len(quarries), seed)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 1)
