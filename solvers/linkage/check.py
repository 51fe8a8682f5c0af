"""Evaluating a given linkage: what kind it is, whether it turns, how it strikes, what it carries and what it sweeps."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.accuracy import require_accuracy
from solvers.effects import AUTO, Demand, EffectSelection
from solvers.errors import require
from solvers.linkage import tolerances
from solvers.linkage.effects import Situation, choose_for
from solvers.linkage.elasticity import worst_elastic_peak
from solvers.linkage.envelope import Box, enclosing_radius, least_box, sweep
from solvers.linkage.four_bar import FourBar, greatest_transfers, of_family
from solvers.linkage.impact import steady_running
from solvers.linkage.kinds import ChangePoint, Ratios
from solvers.linkage.loads import SHARP, Peaks, peaks_of, unit_peaks
from solvers.linkage.result import Lengths, LinkageCheck, Mechanism, Strike
from solvers.linkage.scene import STRENGTH_SPEED, Limits, Scene
from solvers.linkage.tolerances import Closure
from solvers.linkage.warnings import warnings_of
from solvers.outcome import Accuracy, Outcome, Status

Array = NDArray[np.float64]
TRANSFER_POINTS = 181
_ROUNDING, _ORIENTATION = 1e-14, 1e-13
"""Relative errors of what is in closed form, and of the least box: so sharp an orientation costs microseconds."""
NO_STEADY_RUNNING = "no steady running was found: the motor stalls, or its line is far too steep for the inertias"
PLAIN = Limits()


def of_ratio(scene: Scene, kind: ChangePoint, parameter: float) -> Mechanism:
    """The mechanism of a kind made for the scene's restitution, with its free ratio; sized by the scene.

    With a tool radius the rocker is that long; else the crank follows from speed and frequency.
    """
    require(math.isfinite(parameter) and parameter > 1e-6, f"ratios.{kind.parameter}", "must be positive", "(0, inf)")
    gain = scene.restitution.gain
    if kind.name == "largest_rocker":
        least = kind.least_parameter(gain)
        allowed = f"above g² = {least:.6g}"
        require(parameter > least, f"ratios.{kind.parameter}", "gives no mechanism of this type", allowed)
    bar = of_family(kind, scene.restitution.middle, parameter)
    if scene.tool_radius is None:
        crank = scene.impact_speed / (scene.crank_speed * bar.ratios.rocker * bar.end)
    else:
        crank = scene.tool_radius / float(bar.ratios.rocker)
    return Mechanism(bar, crank, Closure(kind, 0.0, 0.0))


def of_lengths(lengths: Lengths, preferred: ChangePoint | None = None) -> Mechanism:
    """A mechanism of given lengths, as the kind whose closure it comes nearest to.

    ``preferred`` is the kind taken where it closes as more than one.
    """
    found = tolerances.closure(lengths.base, lengths.crank, lengths.coupler, lengths.rocker, preferred)
    base, coupler, rocker = (x / lengths.crank for x in (lengths.base, lengths.coupler, lengths.rocker))
    less = [(x - lengths.crank) / lengths.crank for x in (lengths.base, lengths.coupler, lengths.rocker)]
    return Mechanism(FourBar(found.kind, Ratios(base, coupler, rocker, *less)), lengths.crank, found)


def tool_speed(scene: Scene, mechanism: Mechanism) -> float:
    """Speed [m/s] of the tool before the blow at the scene's frequency; 0 for a mechanism that cannot strike."""
    return scene.crank_speed * _tool_radius(scene, mechanism) * mechanism.bar.end if can_strike(mechanism) else 0.0


def can_strike(mechanism: Mechanism) -> bool:
    """Whether the links close, and the crank pin lies so that the rocker can reverse at the blow: kappa, e > 0."""
    bar = mechanism.bar
    lever = float(bar.kind.turn(bar.ratios)) * (-1.0 if bar.kind.name == "largest_base" else 1.0)
    return mechanism.closure.closes and float(bar.kind.reach(bar.ratios)) > 0 and lever > 0


def _tool_radius(scene: Scene, mechanism: Mechanism) -> float:
    return mechanism.crank * float(mechanism.bar.ratios.rocker) if scene.tool_radius is None else scene.tool_radius


def check(
    scene: Scene,
    mechanism: Mechanism,
    limits: Limits = PLAIN,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    demands: tuple[Demand, ...] = (),
) -> Outcome[LinkageCheck]:
    """Evaluate a linkage.

    ``limits`` pads the box and the circle, and turns the box so that it keeps within width and height where it can;
    nothing else of it is judged. ``accuracy`` is the relative numerical accuracy wanted, 1e-12 …
    1e-1; ``demands`` are effects that somebody's limits call for. Raises InvalidInput where the request makes no
    sense, EffectConflict for an excluded effect in demand.
    """
    own = unit_figures([mechanism])[0]
    return check_with(own, scene, mechanism, limits, effects, effect_tolerance, accuracy, demands)


@dataclass(frozen=True)
class UnitFigures:
    """What the ratios of a mechanism alone settle: whether it can strike, whether its crank turns fully, and of one
    that does both the row of ``loads.unit_peaks`` and the greatest |u31| of the cycle."""

    strikes: bool
    rotatable: bool
    peaks: tuple[float, ...] | None = None
    greatest: float = math.inf


def unit_figures(mechanisms: Sequence[Mechanism]) -> list[UnitFigures]:
    """Of many mechanisms, in one call of each kernel."""
    found = []
    for mechanism in mechanisms:
        rotatable, links = mechanism.bar.rotatable, mechanism.lengths
        if not mechanism.closure.closes:
            rotatable = tolerances.turns_fully(links.base, links.crank, links.coupler, links.rocker)
        found.append(UnitFigures(can_strike(mechanism), rotatable))
    full = [i for i, figures in enumerate(found) if figures.strikes and figures.rotatable]
    if full:
        bars = [mechanisms[i].bar for i in full]
        rows, ends = np.stack([bar.coefficients for bar in bars]), np.array([bar.end for bar in bars])
        loads, tops = unit_peaks(rows, ends, SHARP).tolist(), greatest_transfers(rows).tolist()
        for i, row, top in zip(full, loads, tops, strict=True):
            bar = mechanisms[i].bar
            found[i] = UnitFigures(True, True, tuple(row), max(top, bar.start, bar.end))
    return found


def check_with(
    figures: UnitFigures,
    scene: Scene,
    mechanism: Mechanism,
    limits: Limits = PLAIN,
    effects: EffectSelection = AUTO,
    effect_tolerance: float = 1e-2,
    accuracy: float = 1e-6,
    demands: tuple[Demand, ...] = (),
) -> Outcome[LinkageCheck]:
    """``check`` of a mechanism whose own figures are known."""
    started = time.perf_counter()
    require_accuracy(accuracy)
    bar, closes = mechanism.bar, mechanism.closure.closes
    play = float(bar.coefficients[4])
    strikes, rotatable = figures.strikes, figures.rotatable
    full = strikes and rotatable
    loads = peaks_of(figures.peaks, mechanism.crank, scene.impact_energy) if figures.peaks else None
    choice = choose_for(Situation(scene, bar, mechanism.crank, loads), effects, effect_tolerance, demands)
    confined = None if closes else tolerances.confinement(bar)
    if closes and play < 0:
        confined = 2.0 * math.atan(math.sqrt(float(np.prod(bar.coefficients[:3])) / -play))
    strike = _strike(scene, mechanism, loads, confined, figures.greatest) if strikes else None
    box = radius = running = coupler_peak = restitution_error = tolerance_window = None
    error, unresolved = _ROUNDING, False
    settings: dict[str, float | int | str] = {"transfer_points": TRANSFER_POINTS}
    if full and choice.has("envelope"):
        outline = sweep(bar, mechanism.crank)
        box, radius = _box(outline, limits, _ORIENTATION), enclosing_radius(outline, limits.joint_radius)
        error = max(error, _ORIENTATION + _ROUNDING)
    if strike is not None:
        if choice.has("coupler_elasticity"):
            coupler_peak = worst_elastic_peak(bar, scene.coupler_stiffness, scene.impact_energy, scene.restitution)
        if choice.has("tolerances"):
            restitution_error = tolerances.restitution_error(bar, mechanism.crank, scene.length_tolerance)
            surplus = tolerances.closure_error(bar, mechanism.crank, scene.length_tolerance)
            tolerance_window = tolerances.window(bar, -surplus)
        if full and choice.has("impact_dynamics"):
            tool, middle = _tool_radius(scene, mechanism), scene.restitution.middle
            running = steady_running(bar, scene, scene.drive, tool, middle, 0.1 * accuracy)
            if running is None:
                unresolved = True
            else:
                settings["steps"], error = running.steps, max(error, running.error)
    missed = None if closes else tolerances.window(bar, mechanism.closure.surplus)
    value = LinkageCheck(
        mechanism=mechanism,
        rotatable=rotatable,
        confined=confined,
        strike=strike,
        box=box,
        enclosing_radius=radius,
        window=missed,
        restitution_error=restitution_error,
        tolerance_window=tolerance_window,
        coupler_peak=coupler_peak,
        running=running,
        warnings=(NO_STEADY_RUNNING,) if unresolved else (),
    )
    return Outcome(
        status=Status.SUCCEEDED,
        value=_warned(value, scene),
        effects=choice.manifest,
        accuracy=Accuracy(accuracy, error, settings),
        timing={"solve_s": time.perf_counter() - started},
    )


def _box(outline: Array, limits: Limits, tolerance: float) -> Box:
    """The least box within width and height, or the least of all where none keeps within them."""
    width, height = (math.inf if v is None else v * (1 + 1e-11) for v in (limits.width, limits.height))
    found = least_box(outline, limits.joint_radius, width, height, tolerance)
    return found if found is not None else least_box(outline, limits.joint_radius, tolerance=tolerance)


def _warned(value: LinkageCheck, scene: Scene) -> LinkageCheck:
    from dataclasses import replace

    return replace(value, warnings=value.warnings + warnings_of(value, scene, STRENGTH_SPEED))


def _strike(scene: Scene, mechanism: Mechanism, loads: Peaks | None, confined: float | None, greatest: float) -> Strike:
    bar = mechanism.bar
    if confined is None:
        angles = np.linspace(0.0, 2.0 * math.pi, TRANSFER_POINTS)
    else:
        # The last step before the wall is left out: u31 has no bound there.
        run = np.linspace(0.0, confined, TRANSFER_POINTS // 2 + 1)[:-1]
        angles = np.concatenate([run, 2.0 * math.pi - run[::-1]])
    transfer = bar.transfer(_signed(angles))
    made = bar.restitution
    return Strike(
        start=bar.start,
        end=bar.end,
        restitution=made,
        mismatch=max(abs(scene.restitution.low - made), abs(scene.restitution.high - made)),
        impact_speed=tool_speed(scene, mechanism),
        transmission_angle=float(bar.transmission_angle(math.pi)),
        peaks=loads,
        angles=angles,
        transfer=transfer,
        greatest=_greatest(bar, greatest) if confined is None else math.inf,
    )


def _greatest(bar: FourBar, known: float) -> float:
    """Greatest |u31| of the cycle where it is not known yet: of a mechanism that closes and does not turn."""
    if math.isfinite(known):
        return known
    return max(bar.start, bar.end, float(greatest_transfers(bar.coefficients[None])[0]))


def _signed(phi: Array | float) -> Array:
    """Angles in [0, 2 pi] with those beyond pi counted back from the end of the cycle, which they reach exactly."""
    return np.where(np.asarray(phi) > math.pi, np.minimum(np.asarray(phi) - 2.0 * math.pi, -1e-300), phi)
