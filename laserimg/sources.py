"""Which detectors serve the classes of some rules."""

from collections.abc import Iterable, Sequence

from laserimg.detectors.candidate import Detector
from laserimg.detectors.regions import RegionDetector
from laserimg.detectors.search import Scale, WindowDetector
from laserimg.detectors.window import WindowModel
from laserimg.rules.model import Rules


def detectors_for(
    rules: Rules, models: Iterable[WindowModel], override: Sequence[str] = (), scale: Scale = "metric"
) -> tuple[Detector, ...]:
    """Return the detectors that propose candidates for the classes of the rules.

    Parameters
    ----------
    rules : Rules
        Models of classes without rules are left out.
    models : iterable of WindowModel
    override : sequence of str
        Sources for every class in place of those its rules name.
    scale : "metric" or "plain"
        How window detectors search.

    Raises
    ------
    ConfigError
        If a class has neither a detector nor regions to take candidates from.
    """
    models = list(models)
    if not override:
        rules.check_sources({model.card.label for model in models})
    wanted = {one.label: set(override or one.sources) for one in rules}
    windows = [
        WindowDetector(model, scale)
        for model in models
        if ("hog" if model.card.kind == "hog" else "cascade") in wanted.get(model.card.label, set())
    ]
    from_regions = tuple(label for label, sources in wanted.items() if sources & {"regions", "clusters"})
    return (*windows, *((RegionDetector(from_regions),) if from_regions else ()))
