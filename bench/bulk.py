"""Bulk evaluation: processor time per check [us], compared with single checks and joblib.

Tables take and return arrays, in one compiled loop on one core, at an accuracy of 1e-6. The loop over single checks is
what a user would write; joblib distributes it over two processes, measured by wall-clock time. Lists are what batches
use: one case with its own scene and settings per item, returning objects; answers are the service's JSON without
tables. Minimum over at least three runs and half a second. Scenes: the examples with random dimensions around theirs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from app.designs.kind import Detail, Mode
from app.designs.many import answer_many
from app.designs.registry import KINDS
from solvers import crank, linkage, pin, rod
from solvers.crank.scene import SINGLE
from solvers.effects import AUTO, EffectSelection

COUNT, FEW = 2000, 100
_RUNS, _LONG, _TIMES = 3, 0.5, 10
"""Minimum of at least so many runs and seconds: a hundred quick items take milliseconds, in which all runs may be
disturbed. Repetitions of the list for joblib, so that its start-up does not count."""
_BEAM = ("beam_column", "reciprocating_inertia")


@dataclass(frozen=True)
class Row:
    """One subject: microseconds per item by table, by single checks, and by joblib with two processes."""

    name: str
    table_us: float | None
    list_us: float | None
    loop_us: float | None
    joblib_us: float | None = None


def _per_item(run: Callable[[], object], count: int, clock: Callable[[], float] = time.process_time) -> float:
    """Minimum time per item [us]."""
    run()
    times: list[float] = []
    while len(times) < _RUNS or sum(times) < _LONG:
        began = clock()
        run()
        times.append(clock() - began)
    return 1e6 * min(times) / count


def _only(known: tuple, *names: str) -> EffectSelection:
    every = frozenset(effect.name for effect in known)
    return EffectSelection(include=frozenset(names), exclude=every - set(names))


def _joblib(check: Callable[[object], object], items: list[object]) -> float:
    from joblib import Parallel, delayed

    with Parallel(n_jobs=2) as pool:
        many = items * _TIMES
        return _per_item(lambda: pool(delayed(check)(item) for item in many), len(many), time.perf_counter)


def _alone(case: rod.Case | linkage.Case | pin.Case | crank.Case) -> object:
    return case.evaluate().status


def _rods(name: str, effects: EffectSelection) -> Row:
    request = KINDS["flexible-rod"].jobs[Mode.CHECK].request.model_validate(KINDS["flexible-rod"].example(Mode.CHECK))
    scene, strip = request.scene(), request.strip()
    rng = np.random.default_rng(0)
    sizes = np.array([strip.b, strip.h, strip.l]) * rng.uniform(0.95, 1.1, (FEW, 3))
    sizes[:, 2] = np.minimum(sizes[:, 2], scene.mechanism.rod_length)
    cases = [rod.Case(scene, rod.Dimensions(*row), effects) for row in sizes.tolist()]
    return Row(
        name,
        None,
        _per_item(lambda: rod.check_many(cases), FEW),
        _per_item(lambda: [case.evaluate() for case in cases], FEW),
        _joblib(_alone, cases),
    )


def _linkages(name: str, envelope: bool) -> Row:
    kind, rng = linkage.LARGEST_COUPLER, np.random.default_rng(1)
    restitution, ratio = rng.uniform(0.2, 0.4, FEW), rng.uniform(2.5, 4.0, FEW)
    effects = _only(linkage.EFFECTS, *(["envelope"] if envelope else []))
    scenes = [linkage.Scene(linkage.Restitution(r, r), 20.0, 5.0, 10.0) for r in restitution.tolist()]
    cases = [
        linkage.Case(scene, linkage.of_ratio(scene, kind, p), effects=effects)
        for scene, p in zip(scenes, ratio.tolist(), strict=True)
    ]
    return Row(
        name,
        None,
        _per_item(lambda: linkage.check_many(cases), FEW),
        _per_item(lambda: [case.evaluate() for case in cases], FEW),
        _joblib(_alone, cases),
    )


def _pins(name: str, steps: int) -> Row:
    request = KINDS["pin-profile"].jobs[Mode.CHECK].request.model_validate(KINDS["pin-profile"].example(Mode.CHECK))
    scene, rng = request.scene(), np.random.default_rng(2)
    g, half = scene.geometry, 0.5 * scene.geometry.length
    ends = np.sort(rng.uniform(0.2, 1.0, (COUNT, steps)), axis=1) * half
    ends[:, -1] = half
    bores = g.outer_diameter * rng.uniform(0.3, 0.7, (COUNT, steps))
    starts = np.concatenate([np.zeros((COUNT, 1)), ends[:, :-1]], axis=1)
    x = np.stack([starts, ends], axis=2).reshape(COUNT, -1)[:FEW].tolist()
    shapes = [pin.Profile(tuple(at), tuple(d)) for at, d in zip(x, np.repeat(bores, 2, axis=1).tolist(), strict=False)]
    cases = [pin.Case(scene, shape, effects=_only(pin.EFFECTS, "shear_deflection")) for shape in shapes]
    sizes = g.outer_diameter, g.boss_length, g.small_end_length, g.gap, scene.force
    return Row(
        name,
        _per_item(lambda: pin.check_bores(*sizes, scene.material, bores, ends), COUNT),
        _per_item(lambda: pin.check_many(cases), FEW),
        _per_item(lambda: [case.evaluate() for case in cases], FEW),
        _joblib(_alone, cases),
    )


def _dynamics(name: str, *names: str) -> Row:
    request = (
        KINDS["crank-dynamics"]
        .jobs[Mode.ANALYSIS]
        .request.model_validate(KINDS["crank-dynamics"].example(Mode.ANALYSIS))
    )
    scene, rng = replace(request.scene()[0], engine=SINGLE), np.random.default_rng(3)
    machines = [
        replace(scene.mechanism, rod_length=scene.mechanism.rod_length * f, speed=scene.mechanism.speed * g)
        for f, g in rng.uniform(0.9, 1.2, (FEW, 2)).tolist()
    ]
    cases = [crank.Case(replace(scene, mechanism=m), _only(crank.EFFECTS, *names)) for m in machines]
    return Row(
        name,
        None,
        _per_item(lambda: crank.analyse_many(cases), FEW),
        _per_item(lambda: [case.evaluate() for case in cases], FEW),
        _joblib(_alone, cases),
    )


def _answers(slug: str, mode: Mode) -> Row:
    job, example = KINDS[slug].jobs[mode], KINDS[slug].example(mode)
    bodies = [{**example, "name": str(k)} for k in range(20)]
    requests = [job.request.model_validate(body) for body in bodies]
    return Row(
        f"{slug}, answers to its example",
        None,
        _per_item(lambda: answer_many(slug, mode, bodies, Detail.SCALARS), len(bodies)),
        _per_item(lambda: [job.run(request) for request in requests], len(bodies)),
    )


def measure() -> list[Row]:
    """Every subject."""
    return [
        _rods("rod, core physics", _only(rod.EFFECTS)),
        _rods("rod, bent by its axial force", _only(rod.EFFECTS, *_BEAM)),
        _rods("rod, with shear, friction and its feedback", _only(
            rod.EFFECTS, *_BEAM, "shear", "friction_feedback", "friction"
        )),
        _rods("rod, auto", AUTO),
        _linkages("linkage, core physics", envelope=False),
        _linkages("linkage with box and circle", envelope=True),
        _pins("pin, one bore", 1),
        _pins("pin, three steps", 3),
        _dynamics("crank dynamics, gas alone"),
        _dynamics("crank dynamics, with what goes to and fro", "reciprocating_inertia"),
        _answers("flexible-rod", Mode.CHECK),
        _answers("pin-profile", Mode.CHECK),
        _answers("impact-linkage", Mode.CHECK),
        _answers("crank-dynamics", Mode.ANALYSIS),
    ]  # fmt: skip


def table(rows: list[Row] | None = None) -> list[str]:
    """The rows as a table."""
    lines = ["| | table | list | loop over single ones | joblib, 2 processes |", "|---|---|---|---|---|"]
    for row in measure() if rows is None else rows:
        told = (row.table_us, row.list_us, row.loop_us, row.joblib_us)
        cells = " | ".join("—" if us is None else f"{us:.3g} µs" for us in told)
        lines.append(f"| {row.name} | {cells} |")
    return lines


if __name__ == "__main__":
    print("\n".join(table()))
