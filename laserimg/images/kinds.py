"""The kinds of images, by name."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from difflib import get_close_matches

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ConfigError, ScanError
from laserimg.images.relative_depth import SURROUNDINGS_M, relative_depth
from laserimg.images.stretch import Image, blacken, stretch
from laserimg.images.view_frame import view_frame
from laserimg.normals import normals_by_rows
from laserimg.scan import BoolArray, Float32Array, Scan


def _range(scan: Scan, valid: BoolArray) -> Image:
    return stretch(scan.range, valid)


def _reflectance(scan: Scan, valid: BoolArray) -> Image:
    if scan.reflectance is None:
        raise ScanError("the scan has no reflectance: no image of it can be made")
    return stretch(scan.reflectance, valid)


def _depth_relative(scan: Scan, valid: BoolArray) -> Image:
    return stretch(relative_depth(scan, valid), valid, (-SURROUNDINGS_M, SURROUNDINGS_M))


def _signed(vectors: Float32Array) -> Image:
    """-1 to 1 becomes 0 to 255."""
    return np.asarray(cv2.convertScaleAbs(vectors, alpha=127.5, beta=127.5), np.uint8)


def _absolute(vectors: Float32Array) -> Image:
    return np.asarray(cv2.convertScaleAbs(vectors, alpha=255), np.uint8)


_GRAY: dict[str, Callable[[Scan, BoolArray], Image]] = {
    "range": _range,
    "reflectance": _reflectance,
    "depth_relative": _depth_relative,
}
# From the normals, directions and "up" of some rows.
_OF_NORMALS: dict[str, Callable[[Float32Array, Float32Array, NDArray[np.float64]], Image]] = {
    "normals": lambda normals, directions, up: _signed(normals),
    "normals_abs": lambda normals, directions, up: _absolute(normals),
    "normals_view": lambda normals, directions, up: _signed(view_frame(directions, normals, up)),
}
IMAGE_KINDS = ("range", "reflectance", *_OF_NORMALS, "depth_relative")
IMAGE_NAMES = (*IMAGE_KINDS, *(f"{kind}.{plane}" for kind in _OF_NORMALS for plane in "rgb"))


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
    wanted, valid = [name.partition(".")[0] for name in names], scan.valid
    gray, of_normals = _side_by_side(
        lambda: {kind: make(scan, valid) for kind, make in _GRAY.items() if kind in wanted},
        lambda: _images_of_normals(scan, [kind for kind in _OF_NORMALS if kind in wanted], valid),
    )
    return {name: _plane(gray | of_normals, name) for name in names}


def _side_by_side(*calls: Callable[[], dict[str, Image]]) -> list[dict[str, Image]]:
    """Results of the calls: in turn where cv2 is told to use one thread, as in workers, else at once."""
    if cv2.getNumThreads() == 1:
        return [call() for call in calls]
    with ThreadPoolExecutor(len(calls)) as pool:
        return [done.result() for done in [pool.submit(call) for call in calls]]


def _images_of_normals(scan: Scan, kinds: list[str], valid: BoolArray) -> dict[str, Image]:
    images = {kind: np.empty((*scan.shape, 3), np.uint8) for kind in kinds}
    for rows, found in normals_by_rows(scan) if images else ():
        for kind, image in images.items():
            image[rows] = blacken(_OF_NORMALS[kind](found, scan.directions[rows], scan.up), valid[rows])
    return images


def _plane(images: dict[str, Image], name: str) -> Image:
    kind, _, plane = name.partition(".")
    return np.ascontiguousarray(images[kind][..., "rgb".index(plane)]) if plane else images[kind]


def check_image_name(name: str) -> None:
    """Raise ConfigError if no image has this name; it tells the nearest that exists."""
    if name in IMAGE_NAMES:
        return
    near = get_close_matches(name, IMAGE_NAMES, n=1, cutoff=0.4)
    hint = f"; nearest: {near[0]}" if near else f"; known: {', '.join(IMAGE_KINDS)}"
    raise ConfigError(f"no image is called {name!r}{hint}")
