"""The normal of the surface at every return of a scan."""

from collections.abc import Iterator

import numpy as np

from laserimg.normals.cells import Cells
from laserimg.normals.noise import Noise
from laserimg.normals.pixels import normals_of_pixels
from laserimg.normals.planes import fit_planes
from laserimg.scan import Float32Array, Scan


def normals(scan: Scan) -> Float32Array:
    """Return the unit normal of the surface at every return, turned to the scanner.

    1. The noise of the range, and of the angle from row to row, is estimated from the scan.
    2. Cells of a few pixels are formed, of one pixel in coarse scans.
    3. Every cell gets a plane: a least-squares fit of the inverse range, which is linear in the
       ray's direction, over the largest window around it or beside it that shows one plane.
    4. Every return gets the normal of the plane that it lies on: a blend of the planes around
       inside a surface, one of them at depth jumps and creases.
    5. The rest, thin things and clutter, get a fit to the returns around them that are near.

    Parameters
    ----------
    scan : Scan
        All its returns are used, also those outside `min_range` and `max_range`.

    Returns
    -------
    (H, W, 3) array of float32
        In the scanner's frame; 0 where nothing returned. Every return has a normal. When no surface can be
        told, as of a single return, the normal points to the scanner.

    References
    ----------
    Paper 2, section 3: "polar coordinates [...] are transformed into Cartesian coordinates and then they
    are represented as a set of normal vectors". How they are computed is not said there; here the
    range image itself is fitted, as in H. Badino, D. Huber, Y. Park, T. Kanade, "Fast and accurate
    computation of surface normals from range images", ICRA 2011, doi:10.1109/ICRA.2011.5980275.

    Differs from Badino et al.: windows grow with the noise and end at edges, and what a window
    shows is tested against the noise.

    Notes
    -----
    Median errors on planes and at edges of the benchmark room (``tools/benchmark.py normals``), in
    degrees: 0.20 and 0.27. What was tried beside it: one window of 11 x 11 pixels around every pixel
    2.69 and 35; the cleanest of 9 such windows 2.61 and 1.44, of 9 windows of 21 x 21 0.73 and 0.66,
    at four to five times the time; cells with one size of window 0.70 and 0.84, without the planes
    of windows beside them 0.23 and 2.91.

    Examples
    --------
    >>> azimuth, elevation = np.radians(np.linspace(30, -30, 61)), np.radians(np.linspace(20, -20, 41))
    >>> wall = 2 / (np.cos(elevation)[:, None] * np.cos(azimuth))
    >>> scan = Scan.from_range_image(wall, azimuth, elevation)
    >>> bool(np.allclose(normals(scan), [-1, 0, 0], atol=1e-3))
    True
    """
    found = np.empty((*scan.shape, 3), np.float32)
    for rows, part in normals_by_rows(scan):
        found[rows] = part
    return found


def normals_by_rows(scan: Scan) -> Iterator[tuple[slice, Float32Array]]:
    """Yield `normals` by blocks of rows, while the processor has them at hand.

    Yields
    ------
    rows : slice
    normals : (h, W, 3) array of float32
    """
    inverse_range = _inverse(scan.range)
    noise = Noise.of(scan)
    cells = Cells.of(scan, inverse_range, noise)
    planes = fit_planes(cells, noise)
    yield from normals_of_pixels(scan, inverse_range, noise, cells, planes)


def _inverse(range_m: Float32Array) -> Float32Array:
    """1/r, and 0 where nothing returned."""
    with np.errstate(divide="ignore"):
        inverted = np.reciprocal(range_m)
    inverted[range_m <= 0] = 0
    return inverted
