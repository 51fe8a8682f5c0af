"""Effects: physics beyond the core model, and their selection.

Each effect estimates its influence: the relative change of the main results if it is left out, with a margin, before it
is solved. ``auto`` omits effects in order of increasing influence as long as the influences of all omitted ones add up
to less than the effect tolerance. An omitted effect is not computed at all; an influence that does not affect the
selection is computed only when the manifest is read.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Generic, Protocol, TypeVar

from solvers.errors import EffectConflict, InvalidInput
from solvers.outcome import EffectReport, EffectState

S = TypeVar("S", contravariant=True)
E = TypeVar("E", bound="Effect")


class Effect(Protocol[S]):
    """An effect beyond the core physics."""

    name: str
    summary: str
    measure: str

    def influence(self, situation: S) -> float:
        """Estimated relative change of the main results if the effect is left out; inf if there is no estimate."""


@dataclass(frozen=True)
class EffectSelection:
    """Effects forced on or off by the user; the others follow their influence (``automatic``) or are all active.

    Names may be given in any collection.
    """

    include: frozenset[str] = frozenset()
    exclude: frozenset[str] = frozenset()
    automatic: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "include", frozenset(self.include))
        object.__setattr__(self, "exclude", frozenset(self.exclude))


_NONE: Mapping[str, str] = {}
AUTO = EffectSelection()
ALL = EffectSelection(automatic=False)


@dataclass(frozen=True)
class Demand:
    """A limit, objective or result that requires an effect."""

    effect: str
    needed_by: str


@dataclass(frozen=True)
class Choice(Generic[E]):
    """The active effects in the package's order, and the manifest of all effects."""

    active: tuple[E, ...]
    manifest: tuple[EffectReport, ...]

    def has(self, name: str) -> bool:
        return name in [effect.name for effect in self.active]


def choose(
    effects: Sequence[E],
    situation: object,
    selection: EffectSelection = AUTO,
    tolerance: float = 1e-2,
    demands: Iterable[Demand] = (),
    unable: Mapping[str, str] = _NONE,
) -> Choice[E]:
    """Select the effects for a situation; ``unable`` maps effects that lack their data to the reason shown in the
    manifest.

    Raises InvalidInput for an unknown name or one both included and excluded, and EffectConflict for an excluded effect
    that a demand needs.
    """
    if not 0 < tolerance <= 1:
        raise InvalidInput("effect_tolerance", "must lie in (0, 1]", "(0, 1]")
    settled = _settled(tuple([effect.name for effect in effects]), selection, tuple(demands))
    if unable:
        settled = settled | {name: (EffectState.SKIPPED, why) for name, why in unable.items()}
    influences = {effect.name: effect.influence(situation) for effect in effects if effect.name not in settled}
    skipped, left_out = set(), 0.0
    for name in sorted(influences, key=influences.__getitem__):
        left_out += influences[name]
        if left_out > tolerance:
            break
        skipped.add(name)

    def decided(name: str) -> tuple[EffectState, str]:
        if name in skipped:
            return EffectState.SKIPPED, f"the influences of all effects left out add up to at most {tolerance:g}"
        if math.isinf(influences[name]):
            return (
                EffectState.ACTIVE,
                "its influence cannot be estimated: without it there is no result, or buckling, resonance or a change "
                "of sign is near",
            )
        return EffectState.ACTIVE, f"leaving it out could change the results by more than {tolerance:g} allows"

    influences.update(dict.fromkeys(unable, 0.0))
    manifest, active = [], []
    for effect in effects:
        state, why = settled.get(effect.name) or decided(effect.name)
        manifest.append(EffectReport(effect.name, state, partial(_influence, influences, effect, situation), why))
        if state is EffectState.ACTIVE:
            active.append(effect)
    return Choice(tuple(active), tuple(manifest))


def _influence(known: dict[str, float], effect: Effect, situation: object) -> float:
    """An effect's influence, cached."""
    if effect.name not in known:
        known[effect.name] = effect.influence(situation)
    return known[effect.name]


@lru_cache(maxsize=256)
def _settled(
    known: tuple[str, ...], selection: EffectSelection, demands: tuple[Demand, ...]
) -> dict[str, tuple[EffectState, str]]:
    """State and reason of the effects that the request alone decides on, independent of the situation."""
    for field, names in (("include", selection.include), ("exclude", selection.exclude)):
        for name in sorted(names.difference(known)):
            raise InvalidInput(f"effects.{field}", f"there is no effect {name!r}", ", ".join(known))
    for name in sorted(selection.include & selection.exclude):
        raise InvalidInput("effects.exclude", f"the effect {name!r} is included as well", "one of the two")
    demanded = {demand.effect: demand.needed_by for demand in demands}
    for name in selection.exclude & demanded.keys():
        raise EffectConflict(name, demanded[name])
    settled: dict[str, tuple[EffectState, str]] = {}
    if not selection.automatic:
        settled.update(dict.fromkeys(known, (EffectState.ACTIVE, "the request asks for all effects")))
    settled.update({name: (EffectState.ACTIVE, f"needed by {needed_by}") for name, needed_by in demanded.items()})
    settled.update(dict.fromkeys(selection.include, (EffectState.ACTIVE, "included by the request")))
    settled.update(dict.fromkeys(selection.exclude, (EffectState.SKIPPED, "excluded by the request")))
    return settled
