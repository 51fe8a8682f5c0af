"""Machines that several tests of the rod share."""

from __future__ import annotations

import numpy as np

from solvers import rod
from solvers.rod.cycle.bent_strip import BentStrip
from solvers.rod.cycle.composition import Composition, strip_of
from solvers.rod.cycle.state import CLAMP, COUPLING, FORCE, HEAD, LATERAL, MOMENT, ROWS, SHEAR, SIDE, SOFTENING, Strip
from solvers.rod.strip.beam_column import constants
from solvers.rod.strip.stiffness import bending_stiffness
from solvers.rod.vibration.natural_frequencies import POLYNOMIALS, all_polynomials, frequency_under

PAPER = rod.Scene(
    rod.Mechanism(crank_radius=1.5e-3, rod_length=45.5e-3, speed=50.0),
    rod.Piston(diameter=20e-3, skirt_length=27e-3, friction_coefficient=0.15),
    rod.SchmidtLoad(p_min=1.4e6, delta=0.25, theta=1.16),
    rod.Material(210e9, 480e6, 1.15, 0.12, 1200e6, 7850.0, loss_factor=0.0),
)
"""The machine of Obolenskaya and Klochko (2014); its material is ours, the paper names none. Nothing damps it."""

STRIP = rod.Dimensions(b=9e-3, h=0.46e-3, l=23e-3)

CORE = rod.EffectSelection(
    include=frozenset({"beam_column", "friction"}),
    exclude=frozenset({"reciprocating_inertia", "rod_inertia", "large_displacement", "shear", "friction_feedback"}),
)
"""Gas load, beam-column and contact: the physics of the paper."""


def random_machine(rng: np.random.Generator, stability: tuple[float, float] = (1.2, 6.0)) -> tuple:
    """A plausible machine and a strip whose stability safety lies in the given range: (scene, dimensions)."""
    from solvers.rod.strip.buckling import critical_coupling

    diameter = 10 ** rng.uniform(-2.3, -0.9)
    length = diameter * rng.uniform(1.5, 5.0)
    free = length * rng.uniform(0.15, 0.95)
    scene = rod.Scene(
        rod.Mechanism(free * 10 ** rng.uniform(-2.5, -0.9), length, 10 ** rng.uniform(0.0, 2.0)),
        rod.Piston(diameter, diameter * rng.uniform(0.6, 2.0), friction_coefficient=rng.uniform(0.0, 0.2)),
        rod.SchmidtLoad(10 ** rng.uniform(4.5, 6.5), rng.uniform(0.02, 0.6), rng.uniform(0.0, 6.28)),
        rod.Material(210e9, 480e6, 1.15, rng.uniform(0.0, 0.3), 1200e6, 7850.0, loss_factor=0.0),
    )
    angle = np.linspace(0, 2 * np.pi, 361)
    compression = float(np.max((scene.load.pressure(angle) - scene.load.reference_pressure()) * scene.piston.area))
    inertia = compression * rng.uniform(*stability) / (210e9 * -critical_coupling(free, length))
    b = diameter * rng.uniform(0.2, 0.7)
    return scene, rod.Dimensions(b, (12 * inertia / b) ** (1 / 3), free)


def bend_state(strip: Strip, force: float, lateral: float, states: np.ndarray, i: int) -> None:
    """Fill column i of a table of states for a given axial force [N] and lateral displacement [m] of the crank pin."""
    coupling = strip.couples * force / strip.stiffness
    q, m, clamp, shear, head = constants(coupling, strip.length, strip.rod_length, strip.compliance)
    rows = [FORCE, LATERAL, COUPLING, SOFTENING, CLAMP, SHEAR, HEAD]
    states[rows, i] = force, lateral, q, m, clamp * lateral, shear * lateral, head * lateral
    states[[SIDE, MOMENT], i] = -strip.stiffness * m * shear * lateral, strip.stiffness * clamp * lateral


def bent(
    scene: rod.Scene,
    strip: rod.Dimensions,
    force: np.ndarray,
    lateral: np.ndarray,
    couples: bool = True,
    shears: bool = False,
) -> BentStrip:
    """The strip under axial forces [N] with the crank pin at lateral strokes [m], (n,) each."""
    ready, states = strip_of(scene, strip, Composition(couples=couples, shears=shears)), np.empty((ROWS, force.size))
    for i, (f, s) in enumerate(zip(force.tolist(), lateral.tolist(), strict=True)):
        bend_state(ready, f, s, states, i)
    return BentStrip.linear(ready, states)


def natural_frequency(scene, strip, force):
    """First natural frequency [Hz] of a strip under a constant axial force [N]."""
    stiffness, line_mass = bending_stiffness(scene, strip), scene.material.density * strip.b * strip.h
    rod_length = scene.mechanism.rod_length
    return frequency_under(all_polynomials(), stiffness, line_mass, strip.l, rod_length, force, POLYNOMIALS)
