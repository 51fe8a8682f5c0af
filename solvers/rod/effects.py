"""Effects of the flexible rod, each with its estimated influence.

Every influence is the effect's change of the main results, evaluated in closed form or to first order, times a margin
(``solvers.rod.influences.first_order``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial

from solvers.effects import AUTO, Choice, Demand, EffectSelection, choose
from solvers.rod.cycle.composition import Composition, Correction
from solvers.rod.cycle.large_displacement import LargeDisplacement
from solvers.rod.influences.first_order import always, in_closed_form, large_displacement, rod_inertia
from solvers.rod.influences.main_results import (
    AXIAL_COUPLING,
    FRICTION_FEEDBACK,
    RECIPROCATING_MASS,
    SHEAR_FLEXIBILITY,
)
from solvers.rod.influences.situation import Situation
from solvers.rod.scene import Dimensions, Scene
from solvers.rod.vibration.steady_response import RodInertia


@dataclass(frozen=True)
class RodEffect:
    """An effect of the flexible rod: description, estimated influence, and the function that adds it to a
    composition."""

    name: str
    summary: str
    measure: str
    influence: Callable[[Situation], float]
    add_to: Callable[[Composition], Composition]


def _with_correction(correction: Correction, composition: Composition) -> Composition:
    return replace(composition, corrections=(*composition.corrections, correction))


def _unchanged(composition: Composition) -> Composition:
    return composition


EFFECTS: tuple[RodEffect, ...] = (
    RodEffect(
        name="reciprocating_inertia",
        summary="inertia of the reciprocating mass in the axial force",
        measure="greatest relative change of the main results without the mass, times a margin",
        influence=partial(in_closed_form, part=RECIPROCATING_MASS),
        add_to=partial(replace, moves=True),
    ),
    RodEffect(
        name="beam_column",
        summary="the axial force stiffens (tension) or softens (compression) the strip",
        measure="greatest relative change of the main results in plain bending, times a margin",
        influence=partial(in_closed_form, part=AXIAL_COUPLING),
        add_to=partial(replace, couples=True),
    ),
    RodEffect(
        name="shear",
        summary="shear flexibility of the strip (Engesser)",
        measure="greatest relative change of the main results rigid in shear, times a margin",
        influence=partial(in_closed_form, part=SHEAR_FLEXIBILITY),
        add_to=partial(replace, shears=True),
    ),
    RodEffect(
        name="friction_feedback",
        summary="the friction force acts back on the axial force",
        measure="greatest relative change of the main results without friction in the axial force, times a margin",
        influence=partial(in_closed_form, part=FRICTION_FEEDBACK),
        add_to=partial(replace, feedback=True),
    ),
    RodEffect(
        name="large_displacement",
        summary="second order of V/l: the elastica's first correction",
        measure="greatest relative change of the main results by the third order of the slope, times a margin",
        influence=large_displacement,
        add_to=partial(_with_correction, LargeDisplacement()),
    ),
    RodEffect(
        name="rod_inertia",
        summary="transverse inertia of the strip, with all harmonics of the axial force",
        measure="greatest relative change of the main results by the response that follows the load and by the "
        "ringing of the first mode, times a margin",
        influence=rod_inertia,
        add_to=partial(_with_correction, RodInertia()),
    ),
    RodEffect(
        name="friction",
        summary="contact pressure of the skirt and friction power",
        measure="1: its results exist only when it runs",
        influence=always,
        add_to=_unchanged,
    ),
)
"""All effects, in the order in which they join a composition: forces, beam, feedback, corrections, results. Friction
adds results that require it and changes no other."""


def choose_for(
    scene: Scene,
    dimensions: Dimensions,
    selection: EffectSelection = AUTO,
    tolerance: float = 1e-2,
    demands: tuple[Demand, ...] = (),
) -> Choice[RodEffect]:
    """Select the effects for a scene with this strip (see ``solvers.effects.choose``)."""
    return choose(EFFECTS, Situation(scene, dimensions, selection.exclude), selection, tolerance, demands)


def compose(choice: Choice[RodEffect]) -> Composition:
    """The composition of the selected effects, based on gas load and plain bending."""
    return _composed(choice.active)


@lru_cache(maxsize=128)
def _composed(active: tuple[RodEffect, ...]) -> Composition:
    composition = Composition()
    for effect in active:
        composition = effect.add_to(composition)
    return composition
