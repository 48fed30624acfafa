"""The classifiers that a map uses: those that ship, or a given one."""

from pathlib import Path
from typing import Self

from laserimg.classify.model import ObjectModel, load_model
from laserimg.detectors.shipped import shipped_folder
from laserimg.errors import ModelError
from laserimg.scan import Scan

# Made by training/map_model.py.
WITH_REFLECTANCE, RANGE_ALONE = "map.npz", "map_range.npz"


class MapModels:
    """One classifier for scans with reflectance, and one for scans without.

    Parameters
    ----------
    with_reflectance, range_alone : ObjectModel
        May be the same.
    """

    def __init__(self, with_reflectance: ObjectModel, range_alone: ObjectModel) -> None:
        self._with_reflectance = with_reflectance
        self._range_alone = range_alone

    @classmethod
    def load(cls, path: Path | None = None) -> Self:
        """Load the shipped classifiers, or one of `laserimg classify train` for all scans.

        Raises
        ------
        ModelError
            If the file is missing or no model.
        """
        if path is not None:
            model = load_model(path)
            return cls(model, model)
        folder = shipped_folder()
        return cls(load_model(folder / WITH_REFLECTANCE), load_model(folder / RANGE_ALONE))

    @property
    def labels(self) -> tuple[str, ...]:
        """Classes of either model."""
        return tuple(dict.fromkeys(self._with_reflectance.labels + self._range_alone.labels))

    def of(self, scan: Scan) -> ObjectModel:
        """Return the classifier for a scan.

        Raises
        ------
        ModelError
            If the scan has no reflectance and the classifier needs it.
        """
        model = self._range_alone if scan.reflectance is None else self._with_reflectance
        if scan.reflectance is None and model.recipe.needs_reflectance:
            raise ModelError(
                f"has no reflectance, which the model's features {model.recipe.features} need: "
                "train one with --features honv, or leave out --model"
            )
        return model
