"""The checks of a candidate: each a value, a limit and a verdict; nothing is dropped here."""

from collections.abc import Container
from dataclasses import dataclass
from math import exp

from laserimg.measure import MetricBox
from laserimg.rules.model import QUANTITIES, ClassRules, Interval
from laserimg.seen_box import SeenBox

# A failed check of a class that lowers scores multiplies the score by this.
DEMOTION = 0.5
# What is smaller than a limit by more than this factor, or larger, is far from it.
_FAR = 2.0
# In simulated scans of the swinging LMS 200 a half rejected 8 of 47 office chairs that were found, this 2.
_LEAST_SIDE = 1 / 3
# Names of the checks of `plausible_box` and `plausible_size`, which reject whatever the score.
BOX_CHECKS = ("box_sides", "box_width", "box_height")
FAR_CHECKS = (*BOX_CHECKS, "far_width")


@dataclass(frozen=True, slots=True)
class Check:
    """A test of a candidate.

    Parameters
    ----------
    name : str
        What was tested: a share, a measured quantity, one of `FAR_CHECKS`, "region" or "suppression".
    value : float
        In metres, a share or a count.
    limit : Interval
        What was allowed.
    passed : bool
    reason : str
        Why it failed, in words; "" when passed.
    """

    name: str
    value: float
    limit: Interval
    passed: bool
    reason: str = ""


def continuity(region_inside: float, region_fills: float, rules: ClassRules) -> tuple[Check, Check]:
    """Return the continuity check (paper 2, section 4): the region lies in the candidate and fills it.

    Differs from the paper: `region_fills` is added, without which any speck in a candidate passes.
    """
    return (
        _share("region_inside", region_inside, rules.region_inside),
        _share("region_fills", region_fills, rules.region_fills),
    )


def sure_enough(score: float, rules: ClassRules) -> tuple[Check, ...]:
    """Return the check of the score, lowered by failed checks or not, if the class limits it."""
    return (_share("score", score, rules.score),) if rules.score > 0 else ()


def _share(name: str, value: float, limit: float) -> Check:
    passed = value > limit
    sign = "<" if round(value, 2) < round(limit, 2) else "<="
    reason = "" if passed else f"{name} {value:.2f} {sign} {limit:.2f}"
    return Check(name, value, Interval(limit, None), passed, reason)


def no_region() -> Check:
    """Return the failed check of a candidate that no region is in."""
    return Check("region", 0.0, Interval(1, None), False, "no object in the candidate")


def size_rules(box: MetricBox, rules: ClassRules) -> tuple[Check, ...]:
    """Return one check for each limit of a class, in the order of the rule file.

    A limit on a quantity that could not be measured (`height_above_floor` without a floor) is
    not checked.
    """
    checks = []
    for name, limit in rules.limits.items():
        value = getattr(box, name)
        if value is not None:
            reason = limit.failure(name, value)
            checks.append(Check(name, float(value), limit, not reason, reason))
    return tuple(checks)


def plausible_box(box: SeenBox, rules: ClassRules) -> tuple[Check, ...]:
    """Return the checks that a box is not far from what its class may be.

    The box itself fits an object by half or better, so that its width and height lie within twice
    the limits; where the border of the grid cuts it, it may be smaller. A box whose one side is not a third
    as high as the other, at the end of a fan, is no rectangle in space: what it shows has no size.
    """
    checks = [_share(BOX_CHECKS[0], box.side_ratio, _LEAST_SIDE)]
    for check, quantity in zip(BOX_CHECKS[1:], ("width", "height"), strict=True):
        value, limit = getattr(box, quantity), rules.limits.get(quantity)
        if value is not None and limit is not None:
            wide = limit.widened(_FAR)
            allowed = Interval(None, wide.high) if quantity in box.cut else wide
            reason = allowed.failure(quantity, value)
            checks.append(Check(check, value, allowed, not reason, reason and f"box {reason}"))
    return tuple(checks)


def plausible_size(size: MetricBox, cut: Container[str], rules: ClassRules) -> tuple[Check, ...]:
    """Return the check that a measured width is at least half of what its class must have.

    One that the border of the grid cuts may be smaller. Limits that are broken only make a candidate
    doubtful, as regions of true objects may be parts of them or more. Of 3067 objects that the shipped
    detectors find in simulated scans none is so narrow. Half of the least height would cost 4 of 160
    wastebaskets, and twice the greatest width 2 of 62 stairs.
    """
    limit = rules.limits.get("width")
    if limit is None or limit.low is None or "width" in cut:
        return ()
    allowed = Interval(limit.widened(_FAR).low, None)
    reason = allowed.failure("width", size.width)
    return (Check(FAR_CHECKS[3], size.width, allowed, not reason, reason and f"far off: {reason}"),)


def demoted_score(score: float, checks: tuple[Check, ...]) -> float:
    """Return the score, lowered once for each failed check."""
    return score * DEMOTION ** sum(not check.passed for check in checks)


def with_odds(score: float, log_odds: float) -> float:
    """Return a score with so much added to the logarithm of its odds.

    Examples
    --------
    >>> round(with_odds(0.5, 1.0986), 3), with_odds(1.0, 1.0)
    (0.75, 1.0)
    """
    factor = exp(log_odds)
    return score * factor / (1 - score + score * factor)


def near_score(checks: tuple[Check, ...]) -> bool:
    """Whether the score of a candidate, if it failed, is at least half its limit."""
    return all(check.passed or _is_not_far(check) for check in checks if check.name == "score")


def near_miss(checks: tuple[Check, ...]) -> bool:
    """Whether a candidate fails by size alone and lies within twice the limits."""
    failed = [check for check in checks if not check.passed]
    return bool(failed) and all(check.name in QUANTITIES and _is_not_far(check) for check in failed)


def _is_not_far(check: Check) -> bool:
    return check.limit.widened(_FAR).contains(check.value)
