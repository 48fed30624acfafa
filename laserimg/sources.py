"""Which detectors serve the classes of some rules."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from laserimg.detectors.agreement import Agreement
from laserimg.detectors.candidate import Detector
from laserimg.detectors.ranked import RankedDetector, proposer
from laserimg.detectors.regions import RegionDetector
from laserimg.detectors.search import Scale, WindowDetector
from laserimg.detectors.second_stage import SecondStage
from laserimg.detectors.window import WindowModel
from laserimg.errors import ConfigError
from laserimg.rules.file import load_rules
from laserimg.rules.model import Rules

_REGIONS = {"regions", "clusters"}


def detectors_for(
    rules: Rules,
    models: Iterable[WindowModel | SecondStage],
    override: Sequence[str] = (),
    scale: Scale = "metric",
) -> tuple[Detector, ...]:
    """Return the detectors that propose candidates for the classes of the rules.

    The second stage of a class scores what its cascades, and regions if it was trained on them, propose;
    with an override that does not name regions, what its cascades propose alone.

    Parameters
    ----------
    rules : Rules
        Models of classes without rules are left out.
    models : iterable of WindowModel or SecondStage
    override : sequence of str
        Sources for every class in place of those its rules name.
    scale : "metric" or "plain"
        How window detectors search.

    Raises
    ------
    ConfigError
        If a class has neither a detector nor regions to take candidates from, or fewer detectors than
        must agree.
    """
    models = list(models)
    if not override:
        # A copy of the shipped rules has classes that only the shipped detectors find: with others they rest.
        rules.check_sources({model.card.label for model in models} | set(load_rules().labels))
    wanted = {one.label: set(override or one.sources) for one in rules}
    windows = [
        WindowDetector(model, scale)
        for model in models
        if not isinstance(model, SecondStage)
        and ("hog" if model.card.kind == "hog" else "cascade") in wanted.get(model.card.label, set())
    ]
    with_regions = not override or not _REGIONS.isdisjoint(override)
    stages = tuple(
        replace(model, regions=model.regions and with_regions)
        for model in models
        if isinstance(model, SecondStage) and wanted.get(model.card.label, set()) - _REGIONS
    )
    served = {stage.card.label for stage in stages}
    proposing = tuple(
        proposer(window.model, scale) for window in windows if window.model.card.label in served
    )
    ranked = (RankedDetector(stages, proposing),) if stages else ()
    alone = _agreeing([window for window in windows if window.model.card.label not in served], rules)
    from_regions = tuple(label for label in wanted if wanted[label] & _REGIONS and label not in served)
    return (*alone, *ranked, *((RegionDetector(from_regions),) if from_regions else ()))


def _agreeing(windows: list[WindowDetector], rules: Rules) -> list[Detector]:
    """The window detectors, those of a class as one where several must agree."""
    found: list[Detector] = []
    for label in dict.fromkeys(window.model.card.label for window in windows):
        mine, least = [window for window in windows if window.model.card.label == label], rules[label].agree
        if least > len(mine):
            raise ConfigError(f"{rules.source}: {label}: {least} detectors must agree, there are {len(mine)}")
        found += [Agreement(tuple(mine), least)] if least > 1 else mine
    return found
