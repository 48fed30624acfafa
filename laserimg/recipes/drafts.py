"""Detectors under way: kept where nothing takes them for detectors until they are whole."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from laserimg.formats.card import card_path


@dataclass(frozen=True, slots=True)
class Draft:
    """A detector that is being trained into a folder.

    A killed training leaves the detector that was there before as it was, and cascades of the new one in
    `draft`, which the next training goes on with.

    Parameters
    ----------
    folder : Path
    label : str
        Its class.
    """

    folder: Path
    label: str

    @property
    def draft(self) -> Path:
        """The folder of its files until they are whole; its name begins with a dot."""
        return self.folder / f".{self.label}.training"

    def published(self, models: Iterable[Path]) -> list[Path]:
        """Move finished models with their cards to their folder; return where they are.

        The second stage of before goes first and the new one comes last: at no time does a second stage stand
        beside cascades that it was not trained with.
        """
        models = list(models)
        for suffix in (".toml", ".npz"):
            (self.folder / f"{self.label}{suffix}").unlink(missing_ok=True)
        for path in sorted(models, key=lambda one: one.suffix == ".npz"):
            if path.parent == self.draft:
                path.replace(self.folder / path.name)
                card_path(path).replace(card_path(self.folder / path.name))
        if not any(self.draft.iterdir()):
            self.draft.rmdir()
        return [self.folder / path.name for path in models]
