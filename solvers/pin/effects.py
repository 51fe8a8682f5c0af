"""The selectable effects of a pin or a bushing, each with an a-priori bound of its influence."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

from solvers.effects import AUTO, Choice, Demand, EffectSelection, choose
from solvers.pin.limits import Limits
from solvers.pin.load.piston_pin import deflection_integrals
from solvers.pin.scene import BushingGeometry, Scene
from solvers.pin.section.flexibility import cowper


@dataclass(frozen=True)
class Physics:
    """Results computed in addition to strength: shear deflection, ring results, bearing pressures."""

    shear_deflection: bool = True
    ovalization: bool = True
    contact_pressure: bool = True


@dataclass(frozen=True)
class Situation:
    """A scene, with the quantities required by the effects' bounds."""

    scene: Scene

    @cached_property
    def shear_to_bending_ratio(self) -> float:
        """Ratio of shear to bending deflection of the solid pin: (E I0/(G A0)) int Q q/int M m."""
        g, m = self.scene.geometry, self.scene.material
        bend, shear = deflection_integrals(self.scene.force, g.boss_length, g.small_end_length, g.gap)
        return m.elastic_modulus * g.inertia * shear / (m.shear_modulus * g.area * bend) if bend > 0.0 else 0.0


class PinEffect(Protocol):
    """An effect: its description, the bound of its influence, and its contribution to the physics."""

    name: str
    summary: str
    measure: str

    def influence(self, situation: Situation) -> float: ...

    def join(self, physics: Physics) -> Physics: ...


@dataclass(frozen=True)
class ShearDeflection:
    """Shear deflection (Cowper).

    For a uniform bore the bound r/(1 + r) is proven: phi v <= 2A + B/2 for u in (0, 1].

    Walls that are thinner at the bosses than in the middle shear relatively more; the factor 1.5 covers them,
    verified on random bores, not proven.
    """

    name: str = "shear_deflection"
    summary: str = "shear adds to the deflection of the middle (Cowper)"
    measure: str = "1.5 r/(1 + r) with r = (2A + B/2) E I0 int Q q/(G A0 int M m): its share of the deflection"

    def influence(self, situation: Situation) -> float:
        if isinstance(situation.scene.geometry, BushingGeometry):
            # The shear contribution grows with the unknown outer diameter, up to the whole deflection.
            return 1.0
        law = cowper(situation.scene.material.poisson)
        r = (2.0 * law.a + 0.5 * law.b) * situation.shear_to_bending_ratio
        return min(1.0, 1.5 * r / (1.0 + r))

    def join(self, physics: Physics) -> Physics:
        return replace(physics, shear_deflection=True)


@dataclass(frozen=True)
class Ovalization:
    """Ring ovalization. It adds results without changing others, so its influence is 1 by definition."""

    name: str = "ovalization"
    summary: str = "the pin flattens as a ring: growth of its diameter, hoop stresses at four points"
    measure: str = "1: its results exist only when it runs"

    def influence(self, situation: Situation) -> float:
        return 1.0

    def join(self, physics: Physics) -> Physics:
        return replace(physics, ovalization=True)


@dataclass(frozen=True)
class ContactPressure:
    name: str = "contact_pressure"
    summary: str = "pressures on the rod's small end and on the bosses"
    measure: str = "1: its results exist only when it runs"

    def influence(self, situation: Situation) -> float:
        return 1.0

    def join(self, physics: Physics) -> Physics:
        return replace(physics, contact_pressure=True)


EFFECTS: tuple[PinEffect, ...] = (ShearDeflection(), Ovalization(), ContactPressure())


def demands_of(limits: Limits) -> tuple[Demand, ...]:
    """Return the effects these limits require."""
    names = ("max_ovalization", "max_ring_stress")
    return tuple(Demand("ovalization", f"limits.{name}") for name in names if getattr(limits, name) is not None)


def choose_for(
    scene: Scene, selection: EffectSelection = AUTO, tolerance: float = 1e-2, demands: tuple[Demand, ...] = ()
) -> Choice[PinEffect]:
    """Select the effects for a scene (see ``solvers.effects.choose``)."""
    return choose(EFFECTS, Situation(scene), selection, tolerance, demands)


def compose(choice: Choice[PinEffect]) -> Physics:
    """Return the physics of the selected effects, in addition to strength and bending."""
    physics = Physics(shear_deflection=False, ovalization=False, contact_pressure=False)
    for effect in choice.active:
        physics = effect.join(physics)
    return physics
