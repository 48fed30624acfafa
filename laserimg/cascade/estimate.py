"""How long training will take, and where the negatives will end: before it begins and while it runs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from laserimg.cascade.checkpoint import StageRecord
from laserimg.cascade.mining import PASSES
from laserimg.cascade.training import Plan

# Measured on two cores of a server at 3 GHz; a run soon replaces them by its own figures.
WINDOWS_A_SECOND = 15e6
SECONDS_A_STAGE = 0.5
_SAMPLES = 3000
# Of the windows accepted those that are taken: they come in clusters, and images are capped.
_TAKEN = 0.5
# Of a stage's negatives those that are new.
_NEW = 0.6
# What a stage lets through of its maximum; and of all windows those with contrast enough.
_USUAL_FALSE_ALARM, _CONTRAST = 0.87, 0.65


@dataclass(frozen=True)
class Forecast:
    """What is to come.

    Attributes
    ----------
    seconds : float
    stages : int
        Stages that the negatives last for.
    rate : float
        False alarms per window in the end.
    """

    seconds: float
    stages: int
    rate: float


def forecast(plan: Plan, windows: int, records: Sequence[StageRecord] = (), jobs: int = 2) -> Forecast:
    """Return what the rest of a run will take.

    Parameters
    ----------
    plan : Plan
    windows : int
        Windows of one pass over the backgrounds.
    records : sequence of StageRecord
        Stages trained so far: their speed and rates are used.
    jobs : int
    """
    rate = records[-1].rate if records else _CONTRAST
    fall = plan.goal.max_false_alarm * _USUAL_FALSE_ALARM
    speed, stage_s = _speed(plan, records, jobs)
    seconds = 0.0
    for number in range(len(records), plan.stages):
        needed = plan.negatives * _NEW / (_TAKEN * rate)
        if rate <= plan.target or needed > PASSES * windows:
            return Forecast(seconds, number, rate)
        seconds += needed / speed + stage_s
        rate *= fall
    return Forecast(seconds, plan.stages, rate)


def _speed(plan: Plan, records: Sequence[StageRecord], jobs: int) -> tuple[float, float]:
    if not records:
        samples = (plan.positives or 1000) + plan.negatives
        return WINDOWS_A_SECOND * jobs, SECONDS_A_STAGE * samples / _SAMPLES
    recent = records[-3:]
    mined = sum(record.before.windows for record in recent) / max(sum(r.mining_s for r in recent), 1e-3)
    # Early stages spend their time on reading images: too few windows to tell the speed by.
    speed = mined if recent[-1].before.windows > 5e6 else WINDOWS_A_SECOND * jobs
    return speed, math.fsum(record.training_s for record in recent) / len(recent)
