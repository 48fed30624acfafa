"""The kinds of images, by name."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from difflib import get_close_matches
from functools import cached_property

import cv2
import numpy as np

from laserimg.errors import ConfigError, ScanError
from laserimg.geometry.blocks import by_row_blocks
from laserimg.images.relative_depth import SURROUNDINGS_M, relative_depth
from laserimg.images.stretch import Image, blacken, stretch
from laserimg.images.view_frame import view_frame
from laserimg.normals import normals
from laserimg.scan import BoolArray, Float32Array, Scan


class _Work:
    """What several images of one scan share, computed when first asked for."""

    def __init__(self, scan: Scan) -> None:
        self.scan, self.valid = scan, scan.valid
        self._images: dict[str, Image] = {}

    @cached_property
    def normals(self) -> Float32Array:
        return normals(self.scan)

    def image(self, name: str) -> Image:
        """Make an image, or one plane of it, once."""
        kind, _, plane = name.partition(".")
        if kind not in self._images:
            self._images[kind] = _MAKERS[kind](self)
        image = self._images[kind]
        return np.ascontiguousarray(image[..., "rgb".index(plane)]) if plane else image


def _range(work: _Work) -> Image:
    return stretch(work.scan.range, work.valid)


def _reflectance(work: _Work) -> Image:
    if work.scan.reflectance is None:
        raise ScanError("the scan has no reflectance: no image of it can be made")
    return stretch(work.scan.reflectance, work.valid)


def _normals(work: _Work) -> Image:
    return _signed(work.normals, work.valid)


def _normals_abs(work: _Work) -> Image:
    return blacken(np.asarray(cv2.convertScaleAbs(work.normals, alpha=255), np.uint8), work.valid)


def _normals_view(work: _Work) -> Image:
    image = np.empty((*work.scan.shape, 3), np.uint8)

    def make(rows: slice) -> None:
        vectors = view_frame(work.scan.directions[rows], work.normals[rows], work.scan.up)
        image[rows] = _signed(vectors, work.valid[rows])

    by_row_blocks(make, work.scan.shape)
    return image


def _depth_relative(work: _Work) -> Image:
    return stretch(relative_depth(work.scan, work.valid), work.valid, (-SURROUNDINGS_M, SURROUNDINGS_M))


def _signed(vectors: Float32Array, valid: BoolArray) -> Image:
    """-1 to 1 becomes 0 to 255."""
    return blacken(np.asarray(cv2.convertScaleAbs(vectors, alpha=127.5, beta=127.5), np.uint8), valid)


_MAKERS: dict[str, Callable[[_Work], Image]] = {
    "range": _range,
    "reflectance": _reflectance,
    "normals": _normals,
    "normals_abs": _normals_abs,
    "normals_view": _normals_view,
    "depth_relative": _depth_relative,
}
IMAGE_KINDS = tuple(_MAKERS)
IMAGE_NAMES = (
    *IMAGE_KINDS,
    *(f"{kind}.{p}" for kind in IMAGE_KINDS if kind.startswith("normals") for p in "rgb"),
)


def make_image(scan: Scan, kind: str) -> Image:
    """Return one image of a scan.

    Parameters
    ----------
    scan : Scan
    kind : str
        One of ``IMAGE_KINDS``, or one plane of an image of normals such as ``normals.r``.

    Returns
    -------
    (H, W) array of uint8, or (H, W, 3) in the order red, green, blue
        0 where the pixel is not valid.

    Raises
    ------
    ConfigError
        If there is no such kind.
    ScanError
        If the image needs reflectance and the scan has none.

    Notes
    -----
    `normals` are those of paper 2, section 3, in the scanner's frame: n_x, n_y, n_z are red, green,
    blue, with -1 as 0 and 1 as 255. `normals_abs` shows |n| with 1 as 255. `normals_view` shows the
    components of `view_frame` in the same scale as `normals`. `depth_relative` goes from 1 at -0.45 m
    to 255 at +0.45 m. `range` and `reflectance` go from 1 to 255 between their 1st and 99th percentile.

    Examples
    --------
    >>> azimuth, elevation = np.radians([4, 2, 0, -2, -4]), np.radians([3, 1, -1, -3])
    >>> scan = Scan.from_range_image(np.full((4, 5), 2.0), azimuth, elevation)
    >>> make_image(scan, "normals").shape, make_image(scan, "normals.b").shape
    ((4, 5, 3), (4, 5))
    """
    return make_images(scan, [kind])[kind]


def make_images(scan: Scan, kinds: Iterable[str] = IMAGE_KINDS) -> dict[str, Image]:
    """Return several images of a scan by name; what they share is computed once.

    Raises
    ------
    ConfigError, ScanError
        As `make_image`.
    """
    names = list(kinds)
    for name in names:
        check_image_name(name)
    work = _Work(scan)
    if cv2.getNumThreads() == 1:
        return {name: work.image(name) for name in names}
    # Normals take the longest and not all of it on two threads: the other images are made beside.
    with ThreadPoolExecutor(1) as pool:
        beside = {name: pool.submit(work.image, name) for name in names if not name.startswith("normals")}
        images = {name: work.image(name) for name in names if name not in beside}
    images |= {name: image.result() for name, image in beside.items()}
    return {name: images[name] for name in names}


def check_image_name(name: str) -> None:
    """Raise ConfigError if no image has this name; it tells the nearest that exists."""
    if name in IMAGE_NAMES:
        return
    near = get_close_matches(name, IMAGE_NAMES, n=1, cutoff=0.4)
    hint = f"; nearest: {near[0]}" if near else f"; known: {', '.join(IMAGE_KINDS)}"
    raise ConfigError(f"no image is called {name!r}{hint}")
