"""What a linkage must keep: its limits, the speed asked for, and that it turns, strikes and lasts."""

from __future__ import annotations

import math
from dataclasses import dataclass

from solvers.linkage.effects import NO_STEADY_RUNNING
from solvers.linkage.problem import Limits
from solvers.linkage.result import LinkageCheck
from solvers.linkage.scene import STRENGTH_SPEED, Scene
from solvers.linkage.warnings import SPEED_SLACK
from solvers.outcome import Accuracy
from solvers.verdict import Criterion, Sense, Verdict, at_least, at_most, equal, slack_of, unknown, yes

_SLOWED = 0.1
"""How much slower, relative, a motor may let the tool strike before that is told."""


@dataclass(frozen=True)
class Given:
    """What of a scene is known, and not a stand-in: lengths [m], the speed of the blow [m/s], its energy [J].

    ``speed_asked`` says that the speed is what somebody wants, not what follows from the rest.
    """

    size: bool = True
    speed: bool = True
    speed_asked: bool = True
    energy: bool = True


def judge(check: LinkageCheck, scene: Scene, accuracy: Accuracy, limits: Limits, given: Given = Given()) -> Verdict:
    """The verdict on a linkage."""
    slack, strike = slack_of(accuracy), check.strike
    criteria = [yes("turns_fully", check.rotatable), yes("strikes", strike is not None)]
    if strike is not None and given.speed:
        if given.speed_asked:
            criteria.append(equal("impact_speed", scene.impact_speed, strike.impact_speed, SPEED_SLACK))
        criteria.append(at_most("greatest_impact_speed", STRENGTH_SPEED, strike.impact_speed, slack, asked=False))
    if NO_STEADY_RUNNING in check.warnings:
        criteria.append(yes("runs_steadily", False))
    elif check.running is not None:
        criteria.append(yes("runs_steadily", True))
    criteria += [*_of_size(check, limits, slack, given), *_of_angle(check, limits, slack)]
    criteria += _of_force(check, limits, slack, given)
    return Verdict(tuple(criteria), (*check.warnings, *_slowed(check, scene, given)))


def _slowed(check: LinkageCheck, scene: Scene, given: Given) -> tuple[str, ...]:
    running = check.running
    if running is None or not given.speed_asked or running.impact_speed > (1.0 - _SLOWED) * scene.impact_speed:
        return ()
    blow = f"{running.impact_speed:.3g} m/s, at {running.blow_frequency:.3g} blows a second"
    return (f"with this motor the tool strikes at {blow}",)


def _of_size(check: LinkageCheck, limits: Limits, slack: float, given: Given) -> list[Criterion]:
    lengths = check.mechanism.lengths
    links = (lengths.base, lengths.crank, lengths.coupler, lengths.rocker)
    box = check.box
    reached = {
        "longest_link": max(links),
        "width": box and box.width,
        "height": box and box.height,
        "enclosing_radius": check.enclosing_radius,
    }
    found = []
    if limits.min_link > 0.0:
        found.append(
            at_least("min_link", limits.min_link, min(links), slack)
            if given.size
            else unknown("min_link", Sense.AT_LEAST, limits.min_link)
        )
    for name, value in reached.items():
        limit = getattr(limits, name)
        if limit is None:
            continue
        known = given.size and value is not None
        found.append(at_most(name, limit, value, slack) if known else unknown(name, Sense.AT_MOST, limit))
    return found


def _of_angle(check: LinkageCheck, limits: Limits, slack: float) -> list[Criterion]:
    """The transmission angle in mid-cycle, which only a crank that turns fully reaches."""
    if limits.transmission_angle is None:
        return []
    low, high = limits.transmission_angle
    ends = [
        (name, sense, judged, limit)
        for name, sense, judged, limit, bites in (
            ("least_transmission_angle", Sense.AT_LEAST, at_least, low, low > 0.0),
            ("greatest_transmission_angle", Sense.AT_MOST, at_most, high, high < math.pi),
        )
        if bites
    ]
    if check.strike is None or not check.rotatable:
        return [unknown(name, sense, limit) for name, sense, _, limit in ends]
    return [judged(name, limit, check.strike.transmission_angle, slack) for name, _, judged, limit in ends]


def _of_force(check: LinkageCheck, limits: Limits, slack: float, given: Given) -> list[Criterion]:
    limit, peaks = limits.max_pin_force, check.strike and check.strike.peaks
    if limit is None:
        return []
    if peaks is None or not given.energy or not given.size:
        return [unknown("max_pin_force", Sense.AT_MOST, limit)]
    found = [at_most("max_pin_force", limit, peaks.force, slack)]
    if check.coupler_peak is not None:
        found.append(at_most("coupler_peak", limit, check.coupler_peak, slack, asked=False))
    return found
