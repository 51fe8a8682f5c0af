"""STEP: read back by OpenCASCADE, once for all parts and sizes, because its import is slow; and the lifetime of its
process."""

from __future__ import annotations

import asyncio
import json
import math
import re
import time
from pathlib import Path

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.exports.export import ExportOptions, Refusal
from app.exports.registry import EXPORTS
from app.jobs import calls
from app.jobs.executor import PoolSettings, ProcessPool
from app.run_exports import Solids, solid_pool
from tests.app.exports import solid_checks
from tests.app.exports.cases import parts, scaled, solved
from tests.clients.bridge import on_a_port

IN_EVERY_SIZE = ("strip", "free", "drillable", "stepped", "cone_cylinder", "stepped bushing", "linkage")


def payload_of(run):
    return json.dumps({"run": run, "options": {}}).encode()


@pytest.fixture(scope="module")
def modeller():
    assert not EXPORTS["step"].missing, "make test installs the extra [cad]"
    pool = solid_pool(solid_checks.answer)
    yield pool
    pool.close()


def test_the_recipe_of_the_guide_works(modeller, client):
    text = (Path(__file__).parents[3] / "docs" / "exports.md").read_text("utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.S)
    with on_a_port(client) as address:
        (made,) = asyncio.run(modeller.run(address, solid_checks.RECIPE, code.encode(), 60.0))
    run = client.get(f"/api/v1/runs/{made['run']}").json()
    assert made["valid"]
    assert made["volume"] == pytest.approx(math.prod(run["result"]["dimensions"].values()), rel=1e-9)
    assert made["size"] > 1000


def test_solids_are_closed_valid_and_as_heavy_as_the_result(modeller):
    cases = {}
    for shape, run in parts().items():
        longest = max(p.value for p in KINDS[run["kind"]].part(run, None).parameters if p.unit == "mm")
        for size, factor in {"own": 1.0, "10 µm": 1e-2 / longest, "10 m": 1e4 / longest}.items():
            if size != "own" and shape not in IN_EVERY_SIZE:
                continue
            cases[shape, size] = {**scaled(run, factor), "id": shape, "name": "=1+1\u202e</x>'"}

    async def all_of_them():
        return {
            case: await modeller.run(run["kind"], f"{calls.EXPORT}step", payload_of(run), 60.0)
            for case, run in cases.items()
        }

    for case, found in asyncio.run(all_of_them()).items():
        run = cases[case]
        part = KINDS[run["kind"]].part(run, None)
        assert len(found) == len(part.solids), case
        assert all(solid["valid"] and solid["closed"] for solid in found), case
        assert found[0]["took"] < 3.0, case
        assert all(f"'{solid.name}'" in found[0]["names"] for solid in part.solids), case
        p = {parameter.name: parameter.value for parameter in part.parameters}
        if part.mass_g is not None:
            mass = found[0]["volume"] * 1e-6 * part.density_kg_m3
            assert mass == pytest.approx(part.mass_g, rel=1e-6), case
        if case[0] == "strip":
            assert found[0]["size"] == pytest.approx([p["l_mm"], p["b_mm"], p["h_mm"]], rel=1e-3), case
        if case[0] == "linkage":
            r, q, t = p["joint_radius_mm"], p["joint_hole_radius_mm"], p["link_thickness_mm"]
            for solid, name in zip(found, ("base", "crank", "coupler", "rocker"), strict=True):
                flat = 2.0 * r * p[f"{name}_mm"] + math.pi * (r * r - 2.0 * q * q)
                assert solid["volume"] == pytest.approx(flat * t, rel=1e-6), case


def test_what_a_modeller_cannot_hold_is_refused_before_it_is_asked():
    run = scaled(solved("flexible-rod", Mode.CHECK), 1e-6)
    refused = EXPORTS["step"].file(KINDS["flexible-rod"], run, ExportOptions())
    assert isinstance(refused, Refusal)


def test_its_process_starts_when_asked_for_and_ends_when_long_unused():
    """An ordinary pool; the modeller is irrelevant here."""
    run = solved("flexible-rod", Mode.CHECK)
    pools = []

    def start():
        settings = PoolSettings(
            workers=1,
            load=calls.no_load,
            preload=solid_checks.__name__,
            kernels=False,
        )
        pools.append(ProcessPool(settings))
        return pools[-1]

    async def life():
        solids = Solids(start, idle_s=0.3)
        assert not solids.running
        made = await solids.run("flexible-rod", f"{calls.EXPORT}svg", payload_of(run))
        assert made.content.startswith(b"<svg")
        assert solids.running
        end = time.monotonic() + 20
        while solids.running and time.monotonic() < end:
            await asyncio.sleep(0.05)
        assert not solids.running
        solids.close()

    asyncio.run(life())
    assert len(pools) == 1
