"""Where the detectors that ship with laserimg are, and how any folder of them is loaded."""

from pathlib import Path
from typing import cast

import laserimg
from laserimg.cascade.xml import CascadeInfo, load_cascade, read_cascade_info
from laserimg.detectors.cascade import CascadeModel
from laserimg.detectors.hog import HogModel, load_hog
from laserimg.detectors.second_stage import SecondStage, load_second_stage
from laserimg.detectors.window import WindowModel
from laserimg.errors import ModelError
from laserimg.files import is_hidden, sha256_of
from laserimg.formats.card import IMAGES, PLANES, Card, ImageName, card_path, read_card_of


def shipped_folder() -> Path:
    """Return the folder of shipped detectors: in the package, or beside it in an editable install."""
    package = Path(laserimg.__file__).parent
    inside = package / "cascades"
    return inside if inside.is_dir() else package.parent / "cascades"


def detector_files(path: Path) -> list[Path]:
    """Return the detector files that a file or folder names: every XML, and every NPZ with a card.

    Raises
    ------
    ModelError
        If there is no such file or folder, or none in it.
    """
    if path.is_dir():
        with_card = (file for file in path.glob("*.npz") if file.with_suffix(".toml").exists())
        found = sorted(file for file in (*path.glob("*.xml"), *with_card) if not is_hidden(file))
        if not found:
            raise ModelError(f"{path}: no detectors in it; --cascades none runs the rules alone")
        return found
    if not path.exists():
        raise ModelError(f"{path}: no such file or folder")
    return [path]


def load_model(path: Path, image: str | None = None, label: str | None = None) -> WindowModel | SecondStage:
    """Return the detector of a file.

    Parameters
    ----------
    path : Path
        A cascade (.xml), HOG file or second stage (.npz), with its card (.toml) beside it.
    image, label : str, optional
        What a cascade without a card looks at and finds; a card goes before them.

    Raises
    ------
    ModelError
        If the file or its card is wrong, or a cascade has neither a card nor `image` and `label`.
    """
    card = read_card_of(path)
    if path.suffix.lower() == ".npz":
        if card is None:
            raise ModelError(f"{path}: no card beside it ({card_path(path).name})")
        if card.kind == "svm":
            return load_second_stage(path, card)
        descriptor = load_hog(path)
        _check_fit(card_path(path), card, "hog", tuple(descriptor.winSize))
        return HogModel(path.stem, card, descriptor)
    info = read_cascade_info(path)
    card = card or _made_up_card(path, info, image, label)
    _check_fit(card_path(path), card, info.kind, info.window)
    return CascadeModel(path.stem, card, load_cascade(path), info.last_threshold)


def _check_fit(path: Path, card: Card, kind: str, window: tuple[int, ...]) -> None:
    if (card.kind, card.window) != (kind, window):
        says, holds = (
            f"{k} with a window of {w[0]}x{w[1]}" for k, w in ((card.kind, card.window), (kind, window))
        )
        raise ModelError(f"{path}: says {says}, the detector is {holds}")


def _made_up_card(path: Path, info: CascadeInfo, image: str | None, label: str | None) -> Card:
    if not image or not label:
        raise ModelError(
            f"{path}: no card beside it; write one with laserimg card, or give --image and --label"
        )
    if image not in (*IMAGES, *PLANES):
        raise ModelError(f"no kind of image {image!r}; known: {', '.join((*IMAGES, *PLANES))}")
    return Card(label, info.kind, cast(ImageName, image), info.window, sha256_of(path))
