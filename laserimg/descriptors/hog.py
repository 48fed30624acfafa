"""HOG: histograms of oriented gradients of reflectance images."""

import numpy as np

from laserimg.descriptors.cells import CHUNK, cell_histograms, normalised_blocks
from laserimg.descriptors.differences import central_differences
from laserimg.descriptors.layout import Layout
from laserimg.scan import BoolArray, Float32Array


def hog(images: Float32Array, mask: BoolArray | None = None, layout: Layout | None = None) -> Float32Array:
    """Return the HOG of images of one size.

    1. Gradient of every pixel by central differences.
    2. Its magnitude is voted for the bin of its direction, 0 to 180 degrees, in its cell.
    3. The histograms are normalised in overlapping blocks.

    Parameters
    ----------
    images : (n, h, w) array of float32
        Reflectance, 0 outside the object (its outline counts); or any other values.
    mask : (n, h, w) array of bool, optional
        No difference is taken with pixels outside.
    layout : Layout, optional

    Returns
    -------
    (n, layout.hog_length) array of float32

    Notes
    -----
    Paper 1, section 3.3; N. Dalal and B. Triggs, "Histograms of oriented gradients for human
    detection", 2005, doi:10.1109/CVPR.2005.177. Differs from the latter: votes go to one bin and cell
    without interpolation, as in paper 1 ("for the corresponding bin"), blocks have no Gaussian window
    and plain L2 normalisation, without clipping. The number of cells is fixed, not their size in pixels.

    Examples
    --------
    >>> hog(np.eye(64, dtype=np.float32)[None]).shape
    (1, 3528)
    """
    layout = layout or Layout()
    return normalised_blocks(hog_cells(images, mask, layout), layout)


def hog_cells(images: Float32Array, mask: BoolArray | None, layout: Layout) -> Float32Array:
    """Return the histograms of gradients of every cell before normalisation, (n, cells^2, n_alpha)."""
    values = np.asarray(images, np.float32)
    parts = [slice(first, first + CHUNK) for first in range(0, len(values), CHUNK)]
    histograms = [_cells(values[part], None if mask is None else mask[part], layout) for part in parts]
    empty = np.zeros((0, layout.cells**2, layout.n_alpha), np.float32)
    return np.concatenate([empty, *histograms])


def _cells(images: Float32Array, mask: BoolArray | None, layout: Layout) -> Float32Array:
    across, down = central_differences(images)
    if mask is not None:
        _clear_outside(across, mask, axis=2)
        _clear_outside(down, mask, axis=1)
    # A bin and a half turn on is the same bin: -180 degrees, that of -0, is bin 0 too.
    bins = np.arctan2(down, across)
    bins *= np.float32(layout.n_alpha / np.pi)
    bins += np.float32(layout.n_alpha)
    place = bins.astype(np.int32)
    place[place >= layout.n_alpha] -= layout.n_alpha
    place[place >= layout.n_alpha] -= layout.n_alpha
    np.multiply(across, across, out=across)
    np.multiply(down, down, out=down)
    across += down
    np.sqrt(across, out=across)
    return cell_histograms(place, None, across, layout.n_alpha, layout.cells)


def _clear_outside(differences: Float32Array, mask: BoolArray, axis: int) -> None:
    """Clear differences that reach outside the mask."""
    d, inside = np.moveaxis(differences, axis, 0), np.moveaxis(mask, axis, 0)
    d *= inside
    d[:-1] *= inside[1:]
    d[1:] *= inside[:-1]
