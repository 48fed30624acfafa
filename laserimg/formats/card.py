"""The card of a detector: what a cascade or HOG file was trained on and for."""

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import ConfigDict, Field

from laserimg.errors import ModelError
from laserimg.files import sha256_of, write_text
from laserimg.formats.toml import TomlDocument, parse_toml, read_toml
from laserimg.formats.validation import validated

Kind = Literal["haar", "lbp", "hog", "svm"]
SUFFIX = {"haar": ".xml", "lbp": ".xml", "hog": ".npz", "svm": ".npz"}

# Kinds of image; of those with three planes also each plane alone.
ImageName = Literal[
    "range",
    "reflectance",
    "depth_relative",
    "normals",
    "normals.r",
    "normals.g",
    "normals.b",
    "normals_abs",
    "normals_abs.r",
    "normals_abs.g",
    "normals_abs.b",
    "normals_view",
    "normals_view.r",
    "normals_view.g",
    "normals_view.b",
]
IMAGES = tuple(name for name in get_args(ImageName) if "." not in name)
PLANES = tuple(name for name in get_args(ImageName) if "." in name)

Pixels = Annotated[int, Field(ge=1, le=4096)]
Metres = Annotated[float, Field(gt=0, le=1000)]


@dataclass(frozen=True, slots=True)
class Card:
    """What a detector was trained on and for.

    In the file, `label` has the key ``class``, and the file begins with ``format = 1``.

    Parameters
    ----------
    label : str
        The class it finds.
    kind : "haar", "lbp", "hog" or "svm"
        A second stage is "svm".
    image : str
        Kind of image it looks at, or one plane of it.
    window : (int, int)
        Width and height of its window in pixels.
    sha256 : str
        Of the detector's file.
    object_size_m : (float, float) or None
        Usual width and height of the object in metres; without it the search cannot be metric.
    margin : float
        How far the window reaches over the object on every side, as a share of the object's size.
    stages : int or None
        Of a cascade.
    trained_on : str
    seed : int or None
    recipe_sha256 : str or None
        Of all in a recipe, and of the simulator, that the detector depends on: a cascade of another one is
        trained anew.
    licence : str
    versions : mapping of str to str
        Of the programs that trained it.
    scores : mapping of str to float
    """

    __pydantic_config__ = ConfigDict(strict=True, allow_inf_nan=False, extra="forbid")
    label: Annotated[str, Field(alias="class", min_length=1)]
    kind: Kind
    image: ImageName
    window: tuple[Pixels, Pixels]
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    object_size_m: tuple[Metres, Metres] | None = None
    margin: Annotated[float, Field(ge=0, le=10)] = 0.0
    stages: Annotated[int, Field(ge=1)] | None = None
    trained_on: str = ""
    seed: int | None = None
    recipe_sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")] | None = None
    licence: str = ""
    versions: dict[str, str] = field(default_factory=dict)
    scores: dict[str, float] = field(default_factory=dict)
    format: Literal[1] = 1


def read_card(path: Path) -> Card:
    """Read a card.

    Raises
    ------
    ModelError
        If it is missing or wrong; names file, line and the nearest known key.
    """
    return _card(read_toml(path, ModelError))


def read_card_of(model: Path) -> Card | None:
    """Return the card beside a cascade or HOG file; None if there is no card.

    Raises
    ------
    ModelError
        If the card is wrong, of another kind of file, or of another version of this file.
    """
    path = card_path(model)
    if not path.exists():
        return None
    card = read_card(path)
    if model.suffix.lower() != SUFFIX[card.kind]:
        raise ModelError(f"{path}: kind is '{card.kind}', which {model.name} cannot be")
    if file_sha256(model) != card.sha256:
        raise ModelError(
            f"{model}: is not the file that its card {path.name} describes (sha256); "
            f"if it is meant to be, write the card anew: laserimg card {model}"
        )
    return card


def card_path(model: Path) -> Path:
    """Return where the card of a cascade or HOG file is."""
    return model.with_suffix(".toml")


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file as 64 hexadecimal digits.

    Raises
    ------
    ModelError
        If the file cannot be read.
    """
    try:
        return sha256_of(path)
    except OSError as error:
        raise ModelError(f"{path}: cannot be read: {error.strerror}") from None


def write_card(path: Path, card: Card) -> None:
    """Write a card whole or not at all.

    Raises
    ------
    ModelError
        If a value is none that a card can hold.
    """
    text = card_text(card)
    _card(parse_toml(text, str(path), ModelError))
    write_text(path, text)


def card_text(card: Card) -> str:
    """Return the text of a card, without what is not known."""
    import tomlkit

    values: dict[str, Any] = {"format": card.format}
    for one in fields(card):
        value = getattr(card, one.name)
        if value not in (None, "", {}):
            key = "class" if one.name == "label" else one.name
            values[key] = list(value) if isinstance(value, tuple) else value
    return tomlkit.dumps(values)


def _card(document: TomlDocument) -> Card:
    if "format" not in document.data:
        raise document.error((), "a card must begin with format = 1")
    return validated(document, Card)
