"""How an object becomes the vector that a classifier sees."""

from dataclasses import asdict, dataclass
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray

from laserimg.classify.clouds import ObjectCloud
from laserimg.classify.views import ObjectImages, views_of_cloud
from laserimg.descriptors import Layout, surface_normals
from laserimg.descriptors.cells import normalised_blocks
from laserimg.descriptors.hog import hog_cells
from laserimg.descriptors.hog3d import hog3d_cells
from laserimg.descriptors.honv import honv_cells
from laserimg.errors import ConfigError, ScanError
from laserimg.scan import Float32Array

Features = Literal["honv", "honv+hog", "3dhog", "3dhog+hog"]
Appearance = Literal["reflectance", "range"]
FEATURES = get_args(Features)
APPEARANCES = get_args(Appearance)
MAX_VIEWS = 64

# A factor of e in size counts as much as this length of the descriptor, which has length 1.
SIZE_WEIGHT = 0.4
_MIN_SIZE_M = 0.02


@dataclass(frozen=True, slots=True)
class Recipe:
    """What a classifier looks at.

    Parameters
    ----------
    features : "honv", "honv+hog", "3dhog" or "3dhog+hog"
    views : int
        Virtual places around an object cloud; their descriptors are averaged.
    size : bool
        Append three numbers: log of height, length and breadth. Not in the paper.
    appearance : "reflectance" or "range"
        The image of which gradients are taken. Range is the control that tells what reflectance adds.

    Raises
    ------
    ConfigError
        If a value is none of these.
    """

    features: Features = "honv+hog"
    views: int = 24
    size: bool = False
    appearance: Appearance = "reflectance"

    def __post_init__(self) -> None:
        if self.features not in FEATURES:
            raise ConfigError(f"features must be one of {', '.join(FEATURES)}, got {self.features!r}")
        if self.appearance not in APPEARANCES:
            raise ConfigError(f"appearance must be one of {', '.join(APPEARANCES)}, got {self.appearance!r}")
        if not isinstance(self.views, int) or not 1 <= self.views <= MAX_VIEWS:
            raise ConfigError(f"views must be a whole number from 1 to {MAX_VIEWS}, got {self.views}")
        if not isinstance(self.size, bool):
            raise ConfigError(f"size must be true or false, got {self.size!r}")

    @property
    def needs_reflectance(self) -> bool:
        """Whether objects without reflectance cannot be described."""
        return self.features != "honv" and self.appearance == "reflectance"

    @property
    def length(self) -> int:
        """Numbers that describe an object."""
        layout = Layout()
        descriptor = layout.honv_length + (layout.hog_length if self.features.endswith("+hog") else 0)
        return descriptor + 3 * self.size

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as plain values."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """Return the recipe of plain values.

        Raises
        ------
        ConfigError
            If a key is missing or unknown, or a value is wrong.
        """
        try:
            return cls(**values)
        except TypeError as error:
            raise ConfigError(f"not a recipe: {error}") from None


def describe_cloud(cloud: ObjectCloud, recipe: Recipe) -> Float32Array:
    """Return the vector (recipe.length,) of an object cloud.

    Stray points are taken out, the images of all views are described, and the descriptors averaged
    and scaled to length 1; size numbers follow.

    Raises
    ------
    ScanError
        If the recipe needs reflectance and the object has none.
    """
    cloud = cloud.without_strays()
    return describe_images(views_of_cloud(cloud, recipe.views), cloud.points, recipe)


def describe_images(images: ObjectImages, points: NDArray, recipe: Recipe) -> Float32Array:
    """Return the vector (recipe.length,) of an object from its images.

    Parameters
    ----------
    images : ObjectImages
    points : (n, 3) array
        Its points in metres, z up, for its size.
    recipe : Recipe

    Raises
    ------
    ScanError
        If the recipe needs reflectance and the images have none, or nothing can be seen of the object.
    """
    descriptor = descriptors(images, recipe).mean(axis=0)
    length = float(np.linalg.norm(descriptor))
    if length == 0:
        raise ScanError("nothing of the object can be described: no two returns side by side")
    parts = [descriptor / length]
    if recipe.size:
        parts.append(SIZE_WEIGHT * size_numbers(points))
    return np.concatenate(parts).astype(np.float32)


def descriptors(images: ObjectImages, recipe: Recipe) -> Float32Array:
    """Return the descriptor of every image of an object, (v, n)."""
    layout = Layout()
    directions = honv_cells(surface_normals(images.points(), images.known), layout)
    parts = []
    if recipe.features == "honv":
        return normalised_blocks(directions, layout)
    gradients = _gradients(images, recipe, layout)
    if recipe.features.startswith("3dhog"):
        parts.append(hog3d_cells(gradients, directions, layout))
    else:
        parts.append(directions)
    if recipe.features.endswith("+hog"):
        parts.append(gradients)
    return np.concatenate([normalised_blocks(part, layout) for part in parts], axis=1)


def size_numbers(points: NDArray) -> NDArray[np.float64]:
    """Return log of height, and of the spans between the 2 and 98 % quantiles along the horizontal axes.

    Examples
    --------
    >>> box = np.random.default_rng(0).uniform([0, 0, 0], [4, 2, 1], (5000, 3))
    >>> np.exp(size_numbers(box)).round(1).tolist()
    [1.0, 3.9, 1.9]
    """
    level = points[:, :2] - points[:, :2].mean(axis=0)
    _, axes = np.linalg.eigh(level.T @ level)
    spans = np.ptp(np.quantile(level @ axes, [0.02, 0.98], axis=0), axis=0)
    return np.log(np.maximum([np.ptp(points[:, 2]), spans[1], spans[0]], _MIN_SIZE_M))


def _gradients(images: ObjectImages, recipe: Recipe, layout: Layout) -> Float32Array:
    if recipe.appearance == "range":
        return hog_cells(images.range, images.known, layout)
    if images.reflectance is None:
        raise ScanError(
            f"has no reflectance, which the features {recipe.features} need: "
            "use honv, or range in its place (--appearance range)"
        )
    return hog_cells(images.reflectance, None, layout)
