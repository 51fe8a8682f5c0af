"""The selectable effects of a pin or a bushing, each with its estimated influence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from solvers.effects import Choice, Demand, EffectSelection, choose
from solvers.pin.load.piston_pin import deflection_integrals
from solvers.pin.scene import BushingGeometry, Limits, Scene
from solvers.pin.section.flexibility import cowper


@dataclass(frozen=True)
class Physics:
    """Results computed in addition to strength: shear deflection, ring results, bearing pressures."""

    shear_deflection: bool = True
    ovalization: bool = True
    contact_pressure: bool = True


def _shear_influence(scene: Scene) -> float:
    """1.5 r/(1 + r), with r the ratio of shear to bending deflection of the solid pin, times 2A + B/2.

    For a uniform bore the bound r/(1 + r) is proven: phi v <= 2A + B/2 for u in (0, 1]. Walls that are thinner at the
    bosses than in the middle shear relatively more; the factor 1.5 covers them, verified on random bores, not proven.
    """
    g, m, law = scene.geometry, scene.material, cowper(scene.material.poisson)
    if isinstance(g, BushingGeometry):
        # The shear contribution grows with the unknown outer diameter, up to the whole deflection.
        return 1.0
    bend, shear = deflection_integrals(scene.force, g.boss_length, g.small_end_length, g.gap)
    ratio = m.elastic_modulus * g.inertia * shear / (m.shear_modulus * g.area * bend) if bend > 0.0 else 0.0
    r = (2.0 * law.a + 0.5 * law.b) * ratio
    return min(1.0, 1.5 * r / (1.0 + r))


@dataclass(frozen=True)
class PinEffect:
    """An effect: the field of ``Physics`` that it sets, its description, and its influence in a scene."""

    name: str
    summary: str
    measure: str = "1: its results exist only when it runs"
    influence: Callable[[Scene], float] = lambda _: 1.0


EFFECTS = (
    PinEffect(
        "shear_deflection",
        "shear adds to the deflection of the middle (Cowper)",
        measure="1.5 r/(1 + r) with r = (2A + B/2) E I0 int Q q/(G A0 int M m): its share of the deflection",
        influence=_shear_influence,
    ),
    PinEffect("ovalization", "the pin flattens as a ring: growth of its diameter, hoop stresses at four points"),
    PinEffect("contact_pressure", "pressures on the rod's small end and on the bosses"),
)


def choose_for(scene: Scene, limits: Limits, selection: EffectSelection, tolerance: float) -> Choice[PinEffect]:
    """Select the effects for a scene (see ``solvers.effects.choose``); limits on the ring require its ovalization."""
    names = ("max_ovalization", "max_ring_stress")
    demands = [Demand("ovalization", f"limits.{name}") for name in names if getattr(limits, name) is not None]
    return choose(EFFECTS, scene, selection, tolerance, demands)


def compose(choice: Choice[PinEffect]) -> Physics:
    """Return the physics of the selected effects, in addition to strength and bending."""
    active = {effect.name for effect in choice.active}
    return Physics(*(effect.name in active for effect in EFFECTS))
