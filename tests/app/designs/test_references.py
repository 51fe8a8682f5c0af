"""Stored runs as loads: data taken, and refusals."""

from __future__ import annotations

import pytest
from pydantic import Field, create_model

from app.designs.flexible_rod.request import RunLoad
from app.designs.kind import Mode
from app.designs.references import RunForce, RunReference, UnfitRun, references, replaced
from app.designs.registry import KINDS, job_of
from app.designs.schema import Strict, named, one_of
from solvers.errors import InvalidInput


class Told(Strict):
    force_n: float


_Load = one_of(
    lambda value: "run" if named(value, "kind") == "run" or isinstance(value, RunForce) else "told",
    {"told": Told, "run": RunForce},
    "a force, or a stored run",
)
Part = create_model("Part", __base__=Strict, load=(_Load, Field()))


@pytest.fixture(scope="module")
def run() -> dict:
    kind = KINDS["crank-dynamics"]
    job = job_of(kind, Mode.ANALYSIS)
    answer = job.run(job.request.model_validate(kind.example(Mode.ANALYSIS)))
    spec = kind.example(Mode.ANALYSIS)
    return {"kind": kind.slug, "status": answer.status, "spec": spec, "spec_hash": "abc", "result": answer.result}


def force_of(run: dict, name: str) -> float:
    return next(worst["force_n"] for worst in run["result"]["worst"] if worst["name"] == name)


def test_a_force_is_taken_from_a_worst_instant(run):
    part = Part.model_validate({"load": {"kind": "run", "run_id": "one"}})
    ((path, reference),) = list(references(part))
    assert path == ("load",)
    filled = replaced(part, path, reference.filled(run))
    assert filled.load.force == force_of(run, "wrist_pin_load_max")
    assert filled.load.taken_from == "crank-dynamics abc"
    other = RunForce(kind="run", run_id="one", instant="crank_pin_load_max").filled(run)
    assert other.force == force_of(run, "crank_pin_load_max")
    # Filled-in data survives storage.
    assert Part.model_validate_json(filled.model_dump_json()).load.force == filled.load.force


def test_an_unsuitable_run_is_refused(run):
    asked = RunForce(kind="run", run_id="one")
    with pytest.raises(InvalidInput):
        _ = asked.force
    for unfit in ({**run, "status": "failed"}, {**run, "kind": "flexible-rod"}):
        with pytest.raises(UnfitRun):
            asked.filled(unfit)
    never = {**run["result"], "worst": [{**w, "force_n": -1.0} for w in run["result"]["worst"]]}
    with pytest.raises(UnfitRun, match="never occurs"):
        asked.filled({**run, "result": never})
    with pytest.raises(NotImplementedError):
        RunReference(kind="run", run_id="one").filled(run)


def test_a_rods_load_needs_the_curves_of_a_run_only_for_a_whole_cycle_of_two_strokes(run):
    whole = RunLoad(kind="run", run_id="one")
    instant = whole.model_copy(update={"instant": "gas_force_max"})
    bare = {**run, "result": {name: value for name, value in run["result"].items() if name not in ("cycle", "series")}}
    worst = next(worst for worst in run["result"]["worst"] if worst["name"] == "gas_force_max")
    filled = instant.filled(bare)
    assert (filled.angle_deg, filled.pressure_mpa) == ([worst["angle_deg"]], [worst["pressure_mpa"]])
    assert filled.back_pressure_mpa == run["spec"]["cylinder"]["crankcase_pressure_mpa"]
    with pytest.raises(UnfitRun, match="four strokes"):
        whole.filled(bare)
    two = {**bare, "spec": {**run["spec"], "cylinder": {**run["spec"]["cylinder"], "strokes": 2}}}
    with pytest.raises(UnfitRun, match="without its curves"):
        whole.filled(two)
    # As earlier versions stored it.
    points = {"angle_deg": [0.0, 90.0, 180.0], "pressure_mpa": [0.1, 0.2, 0.1]}
    cycle = {"strokes": 2, **points, "crankcase_pressure_mpa": 0.1}
    filled = whole.filled({**two, "result": {**bare["result"], "cycle": cycle}})
    assert {name: getattr(filled, name) for name in points} == points
