"""Rod design: the search with its proof, compared with general-purpose optimizers.

The problem is the paper's machine with width 4-9 mm, thickness 0.2-1 mm, length 8-26 mm, n_sigma >= 2.65 and n_st >=
1.8, for minimum mass with core effects. The general optimizers call the same compiled kernel (96 angles, 25 sections)
for stresses, with scaled variables: scipy's differential_evolution with default settings and penalties, OpenMDAO's
ScipyOptimizeDriver with SLSQP and finite differences from the middle of the bounds (model set up beforehand), and
scipy's SLSQP from the same start. "Above the optimum" is the mass relative to the proven bound; a negative value would
mean that limits are violated between the sampled angles and sections.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from oracles.dense import rod_stress_envelope
from solvers import rod
from solvers.rod.strip import buckling

ANGLES, SECTIONS = 96, 25
SCENE = rod.Scene(
    rod.Mechanism(crank_radius=1.5e-3, rod_length=45.5e-3, speed=50.0),
    rod.Piston(diameter=20e-3, skirt_length=27e-3, friction_coefficient=0.15),
    rod.SchmidtLoad(p_min=1.4e6, delta=0.25, theta=1.16),
    rod.Material(210e9, 480e6, 1.15, 0.12, 1200e6, 7850.0),
)
PROBLEM = rod.RodProblem(
    SCENE,
    rod.Bounds((4e-3, 9e-3), (0.2e-3, 1e-3), (8e-3, 26e-3)),
    rod.Requirements(2.65, 1.8),
    rod.OBJECTIVES["mass"],
)
CORE = rod.EffectSelection(exclude=frozenset({"rod_inertia", "large_displacement", "shear", "friction_feedback"}))
NOTHING = 1e-3
"""Safety assigned to a buckled strip, whose stresses are meaningless."""


@dataclass(frozen=True)
class Row:
    """One method: median time of a design [s], relative mass above the bound (None: no admissible strip), kernel
    calls."""

    name: str
    seconds: float
    above: float | None
    calls: int | None


class Model:
    """Mass, fatigue and stability safety of a strip by the compiled kernel; counts its calls."""

    def __init__(self, problem: rod.RodProblem) -> None:
        self.problem, self.scene = problem, problem.scene
        angle = np.arange(ANGLES) * 2 * math.pi / ANGLES
        load = self.scene.load
        self.force = -(load.pressure(angle) - load.reference_pressure()) * self.scene.piston.area
        self.lateral = self.scene.mechanism.crank_radius * np.sin(angle)
        self.high, self.low = np.empty((2, SECTIONS)), np.empty((2, SECTIONS))
        bounds = problem.bounds
        top = min(bounds.l[1], self.scene.mechanism.rod_length)
        self.lower = np.array([bounds.b[0], bounds.h[0], bounds.l[0]])
        self.upper = np.array([bounds.b[1], bounds.h[1], top])
        self.calls = 0

    def sizes(self, scaled: np.ndarray) -> np.ndarray:
        return self.lower + np.clip(scaled, 0.0, 1.0) * (self.upper - self.lower)

    def results(self, scaled: np.ndarray) -> tuple[float, float, float]:
        """(mass, n_sigma, n_st) at variables scaled to [0, 1]."""
        self.calls += 1
        b, h, l = (float(v) for v in self.sizes(np.asarray(scaled)))
        material, rod_length = self.scene.material, self.scene.mechanism.rod_length
        mass = material.density * b * h * l
        safety = buckling.critical_force(material.elastic_modulus, b, h, l, rod_length) / -self.force.min()
        if safety <= 1.0:
            return mass, NOTHING, safety
        rod_stress_envelope.stress_envelope(
            self.force, self.lateral, material.elastic_modulus, b, h, l, rod_length, self.high, self.low
        )
        amplitude, mean = 0.5 * (self.high - self.low), np.maximum(0.5 * (self.high + self.low), 0.0)
        use = (material.fatigue_reduction * amplitude + material.mean_stress_sensitivity * mean).max()
        return mass, material.fatigue_limit / float(use), safety

    def admissible(self, scaled: np.ndarray, tolerance: float = 1e-6) -> bool:
        """Whether the limits hold at the angles and sections looked at."""
        _, fatigue, safety = self.results(scaled)
        r = self.problem.requirements
        return fatigue >= r.min_fatigue_safety * (1 - tolerance) and safety >= r.min_stability_safety * (1 - tolerance)


def differential_evolution(model: Model, seed: int = 1) -> np.ndarray:
    """scipy's evolution with its default settings; limits as penalties."""
    from scipy.optimize import differential_evolution as evolve

    r = model.problem.requirements
    scale = model.scene.material.density * float(np.prod(model.upper))

    def penalised(scaled: np.ndarray) -> float:
        mass, fatigue, safety = model.results(scaled)
        short = max(1 - fatigue / r.min_fatigue_safety, 0.0) + max(1 - safety / r.min_stability_safety, 0.0)
        return mass / scale + 10.0 * short

    return evolve(penalised, [(0.0, 1.0)] * 3, rng=seed).x


def slsqp(model: Model, start: np.ndarray) -> np.ndarray:
    """scipy's SLSQP with finite differences from one start."""
    from scipy.optimize import minimize

    r = model.problem.requirements
    scale = model.scene.material.density * float(np.prod(model.upper))
    limits = [
        {"type": "ineq", "fun": lambda x: model.results(x)[1] / r.min_fatigue_safety - 1.0},
        {"type": "ineq", "fun": lambda x: model.results(x)[2] / r.min_stability_safety - 1.0},
    ]
    return minimize(
        lambda x: model.results(x)[0] / scale, start, bounds=[(0.0, 1.0)] * 3, method="SLSQP", constraints=limits,
        options={"ftol": 1e-9, "maxiter": 200},
    ).x  # fmt: skip


def open_mdao(model: Model) -> Callable[[], np.ndarray]:
    """OpenMDAO's SLSQP around the model, set up once; the action starts from the middle of the bounds each time."""
    import openmdao.api as om

    r = model.problem.requirements
    scale = model.scene.material.density * float(np.prod(model.upper))

    class Strip(om.ExplicitComponent):
        def setup(self) -> None:
            self.add_input("x", np.full(3, 0.5))
            for name in ("mass", "fatigue", "stability"):
                self.add_output(name, 1.0)
            self.declare_partials("*", "*", method="fd", step=1e-7)

        def compute(self, inputs, outputs) -> None:
            mass, fatigue, safety = model.results(inputs["x"])
            outputs["mass"], outputs["fatigue"], outputs["stability"] = mass / scale, fatigue, safety

    problem = om.Problem(reports=None)
    problem.model.add_subsystem("strip", Strip(), promotes=["*"])
    problem.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-9, maxiter=200, disp=False)
    problem.model.add_design_var("x", lower=0.0, upper=1.0)
    problem.model.add_objective("mass")
    problem.model.add_constraint("fatigue", lower=r.min_fatigue_safety)
    problem.model.add_constraint("stability", lower=r.min_stability_safety)
    problem.setup()

    def act() -> np.ndarray:
        problem.set_val("x", np.full(3, 0.5))
        problem.run_driver()
        return problem.get_val("x").copy()

    return act


def _timed(action: Callable[[], object], repeats: int) -> tuple[float, object]:
    times, found = [], None
    for _ in range(repeats):
        started = time.perf_counter()
        found = action()
        times.append(time.perf_counter() - started)
    return statistics.median(times), found


def run() -> list[Row]:
    """Every way once to warm up, then measured."""
    model = Model(PROBLEM)
    rod.design(PROBLEM, CORE)
    seconds, outcome = _timed(lambda: rod.design(PROBLEM, CORE), 21)
    bound = outcome.certificate.bound
    rows = [Row("this design, with its proof", seconds, outcome.value.check.mass / bound - 1.0, None)]
    start = np.full(3, 0.5)
    ways = (
        ("OpenMDAO, SLSQP", open_mdao(model), 11),
        ("scipy SLSQP", lambda: slsqp(model, start), 11),
        ("scipy differential_evolution", lambda: differential_evolution(model), 3),
    )
    for name, action, repeats in ways:
        action()
        model.calls = 0
        seconds, found = _timed(action, repeats)
        calls = model.calls // repeats
        above = model.results(found)[0] / bound - 1.0 if model.admissible(found, 1e-4) else None
        rows.append(Row(name, seconds, above, calls))
    return rows


def table() -> list[str]:
    """The page's lines."""
    rows = run()
    lines = ["| way | time | against ours | above the optimum | kernel calls |", "|---|---|---|---|---|"]
    for row in rows:
        above = "no admissible strip" if row.above is None else f"{row.above:.1e}"
        calls = "" if row.calls is None else f"{row.calls:,}"
        lines.append(
            f"| {row.name} | {row.seconds * 1e3:,.1f} ms | {row.seconds / rows[0].seconds:,.1f} | {above} | {calls} |"
        )
    return lines
