"""The recipe of a detector: which scans, cascades and second stage, in one TOML file."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from laserimg.errors import ConfigError
from laserimg.formats.card import ImageName, Metres
from laserimg.formats.toml import TomlDocument, read_toml, unknown_name
from laserimg.formats.validation import validated
from laserimg.simulate.objects import OBJECTS
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.scenes import SCENES
from laserimg.simulate.sets import LABELS

Count = Annotated[int, Field(ge=1, le=1_000_000)]
Share = Annotated[float, Field(gt=0, le=1)]
STRICT = ConfigDict(strict=True, allow_inf_nan=False, extra="forbid")


@dataclass(frozen=True, slots=True)
class ScanSet:
    """Simulated scans to train on.

    Parameters
    ----------
    scene, scanner : str
        As for ``laserimg simulate``.
    count : int
    more : tuple of str
        Things of the package of which 1 to 4 each come into every scene beside its own: fewer scans show
        as many objects.
    """

    __pydantic_config__ = STRICT
    scene: str
    scanner: str
    count: Count
    more: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class CascadeRecipe:
    """A cascade that proposes boxes.

    Parameters
    ----------
    name : str
        Beside the class in the file's name.
    image : str
    window : (int, int)
    object_size_m : (float, float)
        Width and height that a window stands for.
    margin : float
    features : str
    stages, negatives : int
    min_hit_rate : float
    max_trees : int
    """

    __pydantic_config__ = STRICT
    name: Annotated[str, Field(pattern=r"^[a-z0-9_]+$")]
    image: ImageName
    window: tuple[Count, Count]
    object_size_m: tuple[Metres, Metres]
    margin: Annotated[float, Field(ge=0, le=2)] = 0.15
    features: Literal["basic", "core", "all"] = "core"
    stages: Count = 9
    negatives: Count = 3000
    min_hit_rate: Share = 0.999
    max_trees: Count = 40


@dataclass(frozen=True, slots=True)
class Recipe:
    """How a detector is made.

    Parameters
    ----------
    label : str
        Key ``class`` of the file.
    scans : tuple of ScanSet
    cascades : tuple of CascadeRecipe
        None, one or several.
    seed : int
    neutral : tuple of str
        Classes of the truth that are neither learnt nor false, as they are much like this one.
    regions : bool
        Whether the rectangles of regions are proposals too.
    cost : float
        C of the second stage's SVM.
    shadows : float
        Share of the objects that are also learnt with their foot in the shadow of the carrier.
    gloss : float
        Share of the objects that are also learnt without the returns that glance off them.
    held_out : float
        Scans to choose the threshold on, and as many again to measure on, as a share of those trained on.
    min_points : int
        Objects of fewer returns are neither learnt nor asked for.
    min_visibility : float
        The same for objects of which less can be seen.
    licence : str
        Of the detector, for its cards.
    """

    __pydantic_config__ = STRICT
    label: Annotated[str, Field(alias="class", pattern=r"^[a-z0-9_]+$")]
    scans: tuple[ScanSet, ...]
    cascades: Annotated[tuple[CascadeRecipe, ...], Field(alias="cascade")] = ()
    seed: Annotated[int, Field(ge=0, le=10**6)] = 0
    neutral: tuple[str, ...] = ()
    regions: bool = True
    cost: Annotated[float, Field(gt=0, le=1e6)] = 0.3
    shadows: Annotated[float, Field(ge=0, le=1)] = 0.3
    gloss: Annotated[float, Field(ge=0, le=1)] = 0.0
    held_out: Share = 0.2
    min_points: Count = 50
    min_visibility: Annotated[float, Field(ge=0, le=1)] = 0.5
    licence: str = ""
    format: Literal[1] = 1

    def scaled(self, factor: float) -> "Recipe":
        """Return the recipe with so many times the scans."""
        scans = tuple(replace(one, count=max(1, round(one.count * factor))) for one in self.scans)
        return replace(self, scans=scans)


def read_recipe(path: Path) -> Recipe:
    """Read a recipe.

    Raises
    ------
    ConfigError
        If it is missing or wrong; names file, line and the nearest known key, class, scene, scanner or thing.
    """
    document = read_toml(path, ConfigError)
    if "format" not in document.data:
        raise document.error((), "a recipe must begin with format = 1")
    recipe = validated(document, Recipe)
    if not recipe.scans:
        raise document.error(("scans",), "a recipe needs scans")
    if not (recipe.cascades or recipe.regions):
        raise document.error((), "a recipe needs a cascade, or regions = true")
    _check_names(document, recipe)
    return recipe


def _check_names(document: TomlDocument, recipe: Recipe) -> None:
    if recipe.label not in LABELS:
        raise document.error(("class",), unknown_name(recipe.label, LABELS, "class"))
    for number, label in enumerate(recipe.neutral):
        if label not in LABELS:
            raise document.error(("neutral", str(number)), unknown_name(label, LABELS, "class"))
    if recipe.label in recipe.neutral:
        raise document.error(("neutral",), f"{recipe.label} is what the recipe learns")
    for number, one in enumerate(recipe.scans):
        names = [("scene", one.scene, SCENES), ("scanner", one.scanner, SCANNERS)]
        names += [("more", kind, OBJECTS) for kind in one.more]
        for key, name, known in names:
            if name not in known:
                what = "thing" if key == "more" else key
                raise document.error(("scans", str(number), key), unknown_name(name, known, what))
