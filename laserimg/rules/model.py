"""The rules: per class, limits on what is measured of a candidate, in metres.

`QUANTITIES` is the one list of what a rule can limit; the rule file, the command line, the checks
and the documentation take names, units and meanings from it.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite, isnan
from types import MappingProxyType
from typing import Literal, get_args

from laserimg.errors import ConfigError
from laserimg.formats.toml import unknown_name

Source = Literal["cascade", "hog", "regions", "clusters"]
OnFail = Literal["reject", "demote", "doubt"]

SOURCES: tuple[Source, ...] = get_args(Source)
ON_FAIL: tuple[OnFail, ...] = get_args(OnFail)
# A class whose rules name no sources takes its candidates from whatever was trained for it.
DETECTORS: tuple[Source, ...] = ("cascade", "hog")
# Shares that a candidate must be above, with their defaults: 0.9 is of paper 2, section 4.
SHARES: Mapping[str, float] = MappingProxyType({"region_inside": 0.9, "region_fills": 0.5, "score": 0.0})
# More cascades of one class nobody has.
MAX_AGREE = 99
# More is a slip of the unit; no scanner measures that far, or that many points at once.
MAX_METRES, MAX_POINTS = 1e5, 10**9


@dataclass(frozen=True, slots=True)
class Quantity:
    """Something measured of every candidate that a rule can limit.

    Parameters
    ----------
    name : str
    unit : "m" or ""
        "" for a count.
    meaning : str
        One line for help and documentation.
    signed : bool
        Whether it can be below 0.
    """

    name: str
    unit: Literal["m", ""]
    meaning: str
    signed: bool = False

    def format(self, value: float, decimals: int = 2) -> str:
        """Return the value with its unit, with at least so many decimals.

        Examples
        --------
        >>> QUANTITIES["height"].format(0.8), QUANTITIES["points"].format(12)
        ('0.80 m', '12')
        """
        return f"{value:.{decimals}f} m" if self.unit else f"{value:.0f}"


QUANTITIES: Mapping[str, Quantity] = MappingProxyType(
    {
        quantity.name: quantity
        for quantity in (
            Quantity("width", "m", "across the horizontal line of sight"),
            Quantity("depth", "m", "along the horizontal line of sight"),
            Quantity("height", "m", "from the lowest point, or from the floor it stands on, to the top"),
            Quantity("length", "m", "long side of the oriented rectangle seen from above"),
            Quantity("breadth", "m", "short side of the oriented rectangle seen from above"),
            Quantity("height_above_floor", "m", "lower face of the box over the floor", signed=True),
            Quantity("range", "m", "distance from the scanner, median over the region"),
            Quantity("points", "", "returns in the region"),
        )
    }
)


@dataclass(frozen=True, slots=True)
class Interval:
    """Closed interval of allowed values; None leaves a side open.

    Raises
    ------
    ConfigError
        If a limit is not finite or the lower is above the upper.

    Examples
    --------
    >>> Interval(0.2, 0.6).contains(0.6), Interval(30, None).contains(12)
    (True, False)
    """

    low: float | None = None
    high: float | None = None

    def __post_init__(self) -> None:
        for limit in (self.low, self.high):
            if limit is not None and not isfinite(limit):
                raise ConfigError(f"a limit must be a finite number, not {limit}")
        if self.low is not None and self.high is not None and self.low > self.high:
            raise ConfigError(f"the lower limit {self.low:g} is above the upper limit {self.high:g}")

    def contains(self, value: float) -> bool:
        """Whether a value is within the limits; NaN never is."""
        return not (isnan(value) or self._below(value) or self._above(value))

    def widened(self, factor: float) -> "Interval":
        """Return the interval with its limits apart by a factor on each side.

        Examples
        --------
        >>> Interval(0.2, 0.6).widened(2), Interval(-1.0, -0.8).widened(2)
        (Interval(low=0.1, high=1.2), Interval(low=-2.0, high=-0.4))
        """
        low, high = self.low, self.high
        return Interval(
            None if low is None else min(low / factor, low * factor),
            None if high is None else max(high / factor, high * factor),
        )

    def failure(self, name: str, value: float) -> str:
        """Return which limit a measured value breaks, in words; "" when it breaks none.

        Parameters
        ----------
        name : str
            One of `QUANTITIES`.
        value : float
            In metres, or a count; NaN when it could not be measured.

        Examples
        --------
        >>> Interval(0.2, 0.6).failure("height", 0.81)
        'height 0.81 m > 0.60 m'
        >>> Interval(30, None).failure("points", 12)
        'points 12 < 30'
        >>> Interval(None, 0.6).failure("height", 0.6004)
        'height 0.6004 m > 0.6000 m'
        """
        if isnan(value):
            return f"{name} not measured"
        if self.low is not None and self._below(value):
            return _comparison(QUANTITIES[name], value, "<", self.low)
        if self.high is not None and self._above(value):
            return _comparison(QUANTITIES[name], value, ">", self.high)
        return ""

    def _below(self, value: float) -> bool:
        return self.low is not None and value < self.low

    def _above(self, value: float) -> bool:
        return self.high is not None and value > self.high

    def format(self, name: str) -> str:
        """Return the limits of a quantity for people.

        Examples
        --------
        >>> Interval(0.2, 0.6).format("height"), Interval(30, None).format("points")
        ('0.20 m to 0.60 m', '30 or more')
        """
        low, high = (
            None if limit is None else _exact(QUANTITIES[name], limit) for limit in (self.low, self.high)
        )
        if low is None or high is None:
            return f"{low} or more" if low else f"{high} or less" if high else "any"
        return f"{low} to {high}"


@dataclass(frozen=True, slots=True)
class ClassRules:
    """What a candidate of one class must be like, and where its candidates come from.

    Parameters
    ----------
    label : str
        Name of the class.
    sources : tuple of str
        Some of `SOURCES`: where candidates come from.
    limits : mapping of str to Interval
        By names of `QUANTITIES`.
    region_inside : float
        The share of a region inside the candidate must be above this (paper 2, section 4: 0.9).
    region_fills : float
        The share of the candidate's returns that are of the region must be above this.
    score : float
        The detector's score must be above this, if it is not 0.
    agree : int
        So many of the class's cascades and HOG detectors must find a place; without a second stage.
    on_fail : "reject", "demote" or "doubt"
        What a failed check does: end it, or lower the score. "doubt" ends what no second stage has scored;
        of the others those that pass all checks score higher, by as much as that was worth in training.
    line : int
        Line of the class in its file, 0 without one.

    Raises
    ------
    ConfigError
        If a source, quantity, share or count is none.
    """

    label: str
    sources: tuple[Source, ...] = DETECTORS
    limits: Mapping[str, Interval] = field(default_factory=dict)
    region_inside: float = SHARES["region_inside"]
    region_fills: float = SHARES["region_fills"]
    score: float = SHARES["score"]
    agree: int = 1
    on_fail: OnFail = "reject"
    line: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "limits", MappingProxyType(dict(self.limits)))
        _check_names(self.limits, QUANTITIES, "quantity")
        _check_names(self.sources, SOURCES, "source")
        _check_names([self.on_fail], ON_FAIL, "on_fail")
        for name in SHARES:
            if not 0 <= getattr(self, name) < 1:
                raise ConfigError(f"{name} must be at least 0 and below 1, is {getattr(self, name)}")
        if not 1 <= self.agree <= MAX_AGREE:
            raise ConfigError(f"agree must be 1 to {MAX_AGREE}, is {self.agree}")

    @property
    def needs_detector(self) -> bool:
        """Whether candidates come only from detectors trained for the class."""
        return set(self.sources) <= set(DETECTORS)


@dataclass(frozen=True, slots=True)
class Rules:
    """The rules of all classes.

    Parameters
    ----------
    classes : tuple of ClassRules
    source : str
        The file they came from.
    sha256 : str
        Of that file.

    Examples
    --------
    >>> rules = Rules((ClassRules("bin", limits={"height": Interval(0.2, 0.6)}),))
    >>> rules["bin"].limits["height"].failure("height", 0.81)
    'height 0.81 m > 0.60 m'
    """

    classes: tuple[ClassRules, ...]
    source: str = ""
    sha256: str = ""

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the classes, in the order of the file."""
        return tuple(rules.label for rules in self.classes)

    def __contains__(self, label: object) -> bool:
        return label in self.labels

    def __iter__(self) -> Iterator[ClassRules]:
        return iter(self.classes)

    def __getitem__(self, label: str) -> ClassRules:
        """Return the rules of a class.

        Raises
        ------
        ConfigError
            If there are none; names the nearest class.
        """
        for rules in self.classes:
            if rules.label == label:
                return rules
        raise ConfigError(f"{self.source or 'rules'}: {unknown_name(label, self.labels, 'class')}")

    def check_sources(self, labels_with_detectors: Collection[str]) -> None:
        """Check that every class has somewhere to take its candidates from.

        Parameters
        ----------
        labels_with_detectors : collection of str
            Classes that a cascade or HOG detector of this run finds.

        Raises
        ------
        ConfigError
            If a class has neither a detector nor regions or clusters as source.
        """
        for rules in self.classes:
            if rules.needs_detector and rules.label not in labels_with_detectors:
                raise ConfigError(
                    f"{self.source}:{rules.line}: class '{rules.label}' has no detector; "
                    'give it one, or set from = ["regions"] or ["clusters"]'
                )


# Every key of a class in the rule file.
KEYS = ("from", *QUANTITIES, *SHARES, "agree", "on_fail")


def _check_names(names: Collection[str], known: Collection[str], what: str) -> None:
    for name in names:
        if name not in known:
            raise ConfigError(unknown_name(name, known, what))


def _exact(quantity: Quantity, value: float, decimals: int = 2) -> str:
    """Return the value with as many decimals as it needs, at least `decimals`."""
    while decimals < 9 and round(value, decimals) != value:
        decimals += 1
    return quantity.format(value, decimals)


def _comparison(quantity: Quantity, value: float, sign: str, limit: float) -> str:
    # Enough decimals for the sentence to be true: never "0.60 m > 0.60 m".
    decimals = 2
    while decimals < 9 and _same_or_rounded(quantity, value, limit, decimals):
        decimals += 1
    return f"{quantity.name} {quantity.format(value, decimals)} {sign} {quantity.format(limit, decimals)}"


def _same_or_rounded(quantity: Quantity, value: float, limit: float, decimals: int) -> bool:
    same = quantity.format(value, decimals) == quantity.format(limit, decimals)
    return same or round(limit, decimals) != limit
