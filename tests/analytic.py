"""Small analytic scans for tests: exact ranges, known sizes."""

import numpy as np

from laserimg.scan import Scan

LOW, HIGH = 1e-9, 1e9


def ray_grid(azimuth_deg, elevation_deg, wraps=False):
    azimuth, elevation = np.radians(azimuth_deg), np.radians(elevation_deg)
    return Scan.from_range_image(np.ones((len(elevation), len(azimuth))), azimuth, elevation, wraps=wraps)


def boxes_and_floor(grid, boxes, floor_m=-1.5, far_m=20.0, noise_m=0.0, seed=0):
    """Range of axis-parallel boxes ((low corner), (high corner)) over a floor; 0 beyond `far_m`."""
    directions = grid.directions.astype(np.float64)
    directions[np.abs(directions) < LOW] = LOW
    range_m = np.where(directions[..., 2] < 0, floor_m / directions[..., 2], HIGH)
    for low, high in boxes:
        first, second = np.array(low) / directions, np.array(high) / directions
        enter, leave = np.minimum(first, second).max(-1), np.maximum(first, second).min(-1)
        hit = (enter <= leave) & (enter > 0)
        range_m = np.where(hit, np.minimum(range_m, enter), range_m)
    range_m += np.random.default_rng(seed).normal(0, noise_m, range_m.shape) if noise_m else 0
    range_m[range_m > far_m] = 0
    return Scan(range_m.astype(np.float32), grid.directions, wraps=grid.wraps)
