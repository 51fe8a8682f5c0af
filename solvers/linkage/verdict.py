"""Requirements on a linkage: its limits, the required speed, rotatability, ability to strike, and durability."""

from __future__ import annotations

from typing import NamedTuple

from solvers.linkage.constraints import CONSTRAINTS
from solvers.linkage.effects import NO_STEADY_RUNNING
from solvers.linkage.limits import Limits
from solvers.linkage.result import LinkageCheck
from solvers.linkage.scene import STRENGTH_SPEED, Scene
from solvers.linkage.warnings import SPEED_SLACK
from solvers.outcome import Accuracy
from solvers.verdict import Sense, Verdict, at_least, at_most, doubt, equal, slack_of, unknown, yes

_JUDGED = {Sense.AT_LEAST: at_least, Sense.AT_MOST: at_most}
_MAX_SLOWDOWN = 0.1
"""Relative reduction of the impact speed by the motor above which the required speed is not kept."""


class Given(NamedTuple):
    """Scene data that are actual values, not placeholders: lengths [m], impact speed [m/s], energy [J].

    ``speed_asked``: the speed is a requirement, not a consequence of the other data.
    """

    size: bool = True
    speed: bool = True
    speed_asked: bool = True
    energy: bool = True


_ALL_GIVEN = Given()


def judge(
    check: LinkageCheck,
    scene: Scene,
    accuracy: Accuracy,
    limits: Limits,
    given: Given = _ALL_GIVEN,
    designed: bool = False,
) -> Verdict:
    """The verdict on a linkage; ``designed`` if it was designed for these limits."""
    slack, strike = slack_of(accuracy), check.strike
    criteria = [yes("turns_fully", check.mechanism.rotatable), yes("strikes", strike is not None)]
    if strike is not None and given.speed:
        if given.speed_asked:
            criteria.append(equal("impact_speed", scene.impact_speed, strike.impact_speed, SPEED_SLACK))
        criteria.append(at_most("greatest_impact_speed", STRENGTH_SPEED, strike.impact_speed, slack, asked=False))
    slowed = _slowed(check, scene, given)
    if NO_STEADY_RUNNING in check.warnings or check.running is not None:
        criteria.append(yes("runs_steadily", NO_STEADY_RUNNING not in check.warnings and not slowed))
    for row in CONSTRAINTS:
        limit = row.limit(limits)
        if limit is None:
            continue
        value = row.reached(check) if all(getattr(given, name) for name in row.needs) else None
        if value is not None:
            criteria.append(_JUDGED[row.sense](row.name, limit, value, slack, row.asked))
        elif row.asked:
            criteria.append(unknown(row.name, row.sense, limit))
    return Verdict(tuple(criteria), (*check.warnings, *slowed), doubt(accuracy, designed))


def _slowed(check: LinkageCheck, scene: Scene, given: Given) -> tuple[str, ...]:
    running = check.running
    if running is None or not given.speed_asked or running.impact_speed > (1.0 - _MAX_SLOWDOWN) * scene.impact_speed:
        return ()
    blow = f"{running.impact_speed:.3g} m/s, at {running.blow_frequency:.3g} blows a second"
    return (f"with this motor the tool strikes at {blow}",)
