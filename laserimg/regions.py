"""The reference partition of paper 2: pixels whose range changes by no more than a constant step."""

import numpy as np
from numpy.typing import NDArray

from laserimg.lattice import connected, step_links
from laserimg.scan import Scan

Labels = NDArray[np.int32]

CONTINUITY_STEP_M = 0.05
MIN_PIXELS = 16


def reference_regions(scan: Scan, continuity_step_m: float = CONTINUITY_STEP_M) -> Labels:
    """Return the regions of paper 2, section 4, for the whole image at once.

    Two 4-neighbours with returns are linked if their ranges differ by no more than
    `continuity_step_m`; connected sets of more than 15 pixels are regions, numbered from 1 in
    raster order of their first pixel. The result equals repeated `cv2.floodFill` with floating
    range; like there, nothing links across the seam of a full turn.

    Differs from the paper: pixels without a return belong to no region (the paper does not say);
    the flood does not start at pixel (0, 0) alone but everywhere, as the paper's loop does in effect.

    Parameters
    ----------
    scan : Scan
    continuity_step_m : float
        Compared in float32, as `cv2.floodFill` does.

    Returns
    -------
    (H, W) array of int32
        0 = no region.

    Examples
    --------
    >>> range_m = np.repeat([[2.0] * 5 + [3.0] * 5], 4, axis=0)
    >>> scan = Scan.from_range_image(range_m, np.radians(np.arange(10.0, 0, -1)), np.radians([2.0, 1, 0, -1]))
    >>> reference_regions(scan)[0].tolist()
    [1, 1, 1, 1, 1, 2, 2, 2, 2, 2]
    """
    valid = scan.valid
    values = np.where(valid, scan.range, np.float32(np.nan))
    step = np.float32(continuity_step_m)
    links = step_links(values, {(0, 1): step, (1, 0): step}, wraps=False)
    return connected(valid, links, MIN_PIXELS)
