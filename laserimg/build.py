"""From settings to a pipeline."""

from functools import cached_property
from pathlib import Path
from typing import cast

from laserimg.detectors.candidate import Detector
from laserimg.detectors.given import GivenCandidates
from laserimg.detectors.search import Scale
from laserimg.detectors.shipped import detector_files, load_model, shipped_folder
from laserimg.errors import ConfigError
from laserimg.formats.coco_file import read_coco
from laserimg.pipeline import Partitioning, Pipeline
from laserimg.rules.file import SHIPPED, load_rules
from laserimg.rules.model import Rules
from laserimg.settings import Settings
from laserimg.sources import detectors_for


class Build:
    """What a run needs, made from its settings.

    Parameters
    ----------
    settings : Settings
    only_scan : bool
        The run has one scan, which a candidate file of one image is of.

    Raises
    ------
    ConfigError, ModelError, LabelError
        If rules, detectors or candidates are wrong or do not fit each other.
    """

    def __init__(self, settings: Settings, only_scan: bool = False) -> None:
        self.settings = settings
        self.only_scan = only_scan

    @property
    def rules_file(self) -> Path:
        """The rule file of the run."""
        return Path(self.settings.rules) if self.settings.rules else SHIPPED

    @cached_property
    def model_files(self) -> list[Path]:
        """The detector files of the run."""
        chosen = self.settings.cascades
        if chosen == "none" or self.settings.candidates:
            return []
        return detector_files(Path(chosen)) if chosen else detector_files(shipped_folder())

    @property
    def files(self) -> list[Path]:
        """Every file that the results depend on, beside the scans."""
        candidates = [Path(self.settings.candidates)] if self.settings.candidates else []
        cards = [path for path in (file.with_suffix(".toml") for file in self.model_files) if path.exists()]
        return [self.rules_file, *self.model_files, *cards, *candidates]

    def pipeline(self) -> Pipeline:
        """Return the pipeline of the run."""
        settings = self.settings
        rules = load_rules(self.rules_file)
        return Pipeline(
            rules,
            self._detectors(rules),
            cast(Partitioning, settings.partition),
            settings.min_range,
            settings.max_range,
            measures_all=settings.rejected == "all",
        )

    def _detectors(self, rules: Rules) -> tuple[Detector, ...]:
        settings = self.settings
        if settings.candidates:
            return (self._given(rules),)
        models = [load_model(file, settings.image, settings.label) for file in self.model_files]
        for model in models if settings.cascades else []:
            self._check_has_rules(model.card.label, rules, model.name)
        return detectors_for(rules, models, settings.sources, cast(Scale, settings.scale))

    def _given(self, rules: Rules) -> GivenCandidates:
        coco = read_coco(Path(cast(str, self.settings.candidates)))
        label = self.settings.label
        for name in {label} if label else sorted(set(coco.labels.values())):
            self._check_has_rules(name, rules, str(self.settings.candidates))
        return GivenCandidates(coco, label, self.only_scan)

    def _check_has_rules(self, label: str, rules: Rules, source: str) -> None:
        if label not in rules:
            raise ConfigError(
                f"{self.rules_file}: no rules for class {label!r} of {source}; "
                f"add them (laserimg rules set {label}.from cascade), or name another class with --label"
            )
