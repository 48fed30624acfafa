"""Points without a grid become a scan: by the order they stand in, else by projection."""

import numpy as np
from numpy.typing import NDArray

from laserimg.readers.grid import scan_from_grid
from laserimg.readers.hidden_grid import recover
from laserimg.scan import BoolArray, Scan


def scan_from_points(
    points: NDArray[np.float64],
    reflectance: NDArray | None = None,
    ring: NDArray[np.integer] | None = None,
    returned: BoolArray | None = None,
    world_from_scan: NDArray[np.float64] | None = None,
) -> Scan:
    """Make a scan from points in the scanner's frame, in the order of the file.

    Parameters
    ----------
    points : (N, 3) array
        Metres.
    reflectance : (N,) array, optional
    ring : (N,) array of int, optional
        Number of the beam of a spinning scanner.
    returned : (N,) array of bool, optional
        False where a point only tells the direction of its ray.
    world_from_scan : (4, 4) array, optional

    Raises
    ------
    ScanError
        If nothing returned, or the points make no grid.
    """
    pose = np.eye(4) if world_from_scan is None else world_from_scan
    measured = np.ones(len(points), bool) if returned is None else returned
    grid = recover(points, ring)
    if grid is None:
        values = None if reflectance is None else reflectance[measured]
        return Scan.from_points(points[measured], reflectance=values, world_from_scan=pose)
    shift = np.eye(4)
    shift[:3, 3] = grid.origin
    values = None if reflectance is None else grid.place(reflectance)
    # Zero stays the sign for "no measurement" when the origin moves.
    seen = np.where(grid.kept[:, None], points - grid.origin, 0)
    return scan_from_grid(
        grid.place(seen), values, grid.place(measured), grid.wraps, world_from_scan=pose @ shift
    )
