"""HONV: histograms of oriented normal vectors of range images."""

import numpy as np
from numpy.typing import NDArray

from laserimg.descriptors.cells import CHUNK, cell_histograms, normalised_blocks
from laserimg.descriptors.layout import Layout
from laserimg.scan import Float32Array


def honv(normals: Float32Array, layout: Layout | None = None) -> Float32Array:
    """Return the HONV of images of one size.

    Every pixel that has a normal votes for the bin of theta and phi, in its cell; the histograms are
    normalised in overlapping blocks.

    Parameters
    ----------
    normals : (n, h, w, 3) array of float32
        Unit normals, x right, y down, z away from the scanner, turned to the scanner; 0 for none. Either
        kind of `laserimg.descriptors.normal_images`.
    layout : Layout, optional

    Returns
    -------
    (n, layout.honv_length) array of float32
        A histogram has theta as its first index and phi as its second.

    Notes
    -----
    Paper 1, section 3.4; S. Tang et al., "Histogram of oriented normal vectors for object recognition
    with a depth sensor", 2012, doi:10.1007/978-3-642-37444-9_41. Differs from the paper: phi is
    atan2, over 360 degrees, where eq. 3 has a quotient that folds it to 180 (``Layout(signed=False)``);
    pixels outside the object have no vote; blocks are normalised as those of `hog`.

    Examples
    --------
    >>> facing = np.broadcast_to(np.float32([0, 0, -1]), (1, 64, 64, 3))
    >>> honv(facing).shape, int(np.count_nonzero(honv(facing)))
    ((1, 15876), 196)
    """
    layout = layout or Layout()
    return normalised_blocks(honv_cells(normals, layout), layout)


def honv_cells(normals: Float32Array, layout: Layout) -> Float32Array:
    """Return the histograms of normals of every cell before normalisation, (n, cells^2, n_theta * n_phi)."""
    vectors = np.asarray(normals, np.float32)
    parts = [vectors[first : first + CHUNK] for first in range(0, len(vectors), CHUNK)]
    empty = np.zeros((0, layout.cells**2, layout.n_theta * layout.n_phi), np.float32)
    return np.concatenate([empty, *(_cells(part, layout) for part in parts)])


def _cells(normals: Float32Array, layout: Layout) -> Float32Array:
    bins = normal_bins(normals, layout)
    return cell_histograms(bins, normals[..., 2] < 0, None, layout.n_theta * layout.n_phi, layout.cells)


def normal_bins(normals: Float32Array, layout: Layout) -> NDArray[np.int32]:
    """Return the bin of every normal, n_phi times that of theta and that of phi."""
    x, y, z = (np.ascontiguousarray(normals[..., axis]) for axis in range(3))
    theta = np.arctan2(np.sqrt(x * x + y * y), -z)
    row = np.minimum((theta * np.float32(layout.n_theta * 2 / np.pi)).astype(np.int32), layout.n_theta - 1)
    turn = np.float32(np.radians(layout.phi_range_deg))
    phi = np.arctan2(y, x) / turn
    column = np.minimum(((phi - np.floor(phi)) * layout.n_phi).astype(np.int32), layout.n_phi - 1)
    return row * np.int32(layout.n_phi) + column
