"""Costs of the rod's effects on one machine: reference, solver and peers agree in every part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.work_precision import flexible_rod_effects as effects
from bench.work_precision.curves import measure
from bench.work_precision.page import diagram, table, written
from oracles.dense.rod_effects import RodModel
from tests.solvers.rod.machines import PAPER, STRIP

CASE = effects.EffectsCase(PAPER, STRIP)


@pytest.mark.parametrize("part", effects.EFFECTS)
def test_all_ways_lead_to_the_reference(part):
    exact = {f"{part}: {name}": value for name, value in CASE.model(part).judged().items()}
    loosest = [
        replace(m, settings=dict(list(m.settings.items())[:3 if m.name == "Crankwright" else 1]))
        for m in effects.methods()
        if m.part == part
    ]  # fmt: skip
    ours, *peers = curves = measure(loosest, [CASE], [exact], repeats=1)
    for point, accuracy in zip(ours.points, effects.LADDER, strict=False):
        assert point.error <= accuracy
    assert peers
    for peer in peers:
        assert ours.points[-1].error < peer.points[0].error < 0.02
    lines = list(table(curves))
    assert sum(line.startswith(f"| {part} |") for line in lines) == 3 + len(peers)
    assert diagram(part, curves).count("<path") == len(curves)


def test_effects_together_differ_from_each_alone():
    """The model with all effects differs from each part; compared at one angle with the core's side force."""
    angle = np.array([1.2])
    core, *alone, whole = (RodModel(PAPER, STRIP, frozenset(p)).bent(angle).side[0] for p in effects.PARTS.values())
    moved = [side / core - 1 for side in alone]
    assert min(map(abs, moved)) > 1e-5
    # To first order the effects are additive.
    assert whole / core - 1 == pytest.approx(sum(moved), rel=0.1)


def test_a_section_is_set_anew_and_the_others_stay():
    page = "# Old head\n\n## B\n\nold b\n\n## A\n\nold a\n"
    found = written(page, "# Head\n", ["A", "B", "C"], {"B": "## B\n\nnew b"})
    assert found == "# Head\n\n## A\n\nold a\n\n## B\n\nnew b\n"
