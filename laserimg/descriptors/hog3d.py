"""3DHOG: the gradients of the reflectance image, laid onto the surface that the range image shows."""

from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from laserimg.descriptors.cells import CHUNK, normalised_blocks
from laserimg.descriptors.hog import hog_cells
from laserimg.descriptors.honv import honv_cells
from laserimg.descriptors.layout import Layout
from laserimg.scan import Float32Array

Votes = Literal["hard", "interpolated"]


def hog3d(
    images: Float32Array, normals: Float32Array, layout: Layout | None = None, votes: Votes = "hard"
) -> Float32Array:
    """Return the 3DHOG of images of one size: Algorithm 1 of paper 1.

    For every cell, every bin (theta, phi) of its HONV and every bin alpha of its HOG: the edge
    A (cos alpha, sin alpha, 0), with A the smallest rotation from the image's normal to that of the bin,
    gets a vote h_alpha * v_theta,phi in the bin of its own direction.

    Parameters
    ----------
    images : (n, h, w) array of float32
        Reflectance, 0 outside the object.
    normals : (n, h, w, 3) array of float32
        As for `honv`.
    layout : Layout, optional
    votes : "hard" or "interpolated"
        A vote goes to one bin, or in shares to the four around its direction.

    Returns
    -------
    (n, layout.hog3d_length) array of float32
        A histogram has theta' as its first index and phi' as its second, both over 0 to 180 degrees.

    Notes
    -----
    Paper 1, section 3.5. Differs from the paper, or decides what it leaves open:

    - N_i = (0, 0, -1) (section 3.5) but eq. 1 has +1 in z: taken literally, A turns by nearly
      180 degrees and is undefined at theta = 0. Here normals are turned to the scanner first; A is
      the identity at theta = 0 and continuous there.
    - The edge is the gradient itself (gradArr), not turned by 90 degrees.
    - The edge is a line, without a sign, as HOG's directions of 0 to 180 degrees are.
      Its bins are theta' = 0 to 180, phi' = 0 to 180 degrees, theta' counted from N_i. Passing
      phi' = 180 turns theta' into 180 - theta'.
    - phi of the normals covers 360 degrees (eq. 3 folds it to 180: ``Layout(signed=False)``).
    - A depends on the bins only, so that steps a) and i) of Algorithm 1 are a table, computed once.

    Examples
    --------
    >>> image = np.tile(np.arange(64, dtype=np.float32), (1, 64, 1))
    >>> facing = np.broadcast_to(np.float32([0, 0, -1]), (1, 64, 64, 3))
    >>> hog3d(image, facing).shape
    (1, 15876)
    """
    layout = layout or Layout()
    return normalised_blocks(
        hog3d_cells(hog_cells(images, None, layout), honv_cells(normals, layout), layout, votes), layout
    )


def hog3d_cells(
    gradients: Float32Array, normals: Float32Array, layout: Layout, votes: Votes = "hard"
) -> Float32Array:
    """Return the 3D histograms of every cell before normalisation.

    Parameters
    ----------
    gradients : (n, cells^2, n_alpha) array of float32
        Of `hog_cells`.
    normals : (n, cells^2, n_theta * n_phi) array of float32
        Of `honv_cells`.
    layout : Layout
    votes : "hard" or "interpolated"

    Returns
    -------
    (n, cells^2, n_theta * n_phi) array of float32
    """
    table = projection_table(layout, votes)
    g = gradients.reshape(-1, layout.n_alpha)
    v = normals.reshape(-1, layout.n_theta * layout.n_phi)
    result = np.zeros_like(v)
    step = CHUNK * layout.cells**2
    for first in range(0, len(v), step):
        part = slice(first, first + step)
        # Most cells have no votes, or few bins of normals: only pairs that occur are multiplied.
        cell, bins = np.nonzero(v[part])
        shares = g[part][cell] * v[part][cell, bins][:, None]
        voted: Any = _pairs(cell, bins, shares, len(v[part]), v.shape[1] * layout.n_alpha) @ table
        result[part] = voted.toarray()
    return result.reshape(normals.shape)


def _pairs(cell: NDArray, bins: NDArray, shares: Float32Array, cells: int, columns: int) -> csr_array:
    """Return the sparse (cells, columns) products of each cell's two histograms."""
    n_alpha = shares.shape[1]
    index = (bins[:, None] * n_alpha + np.arange(n_alpha)).astype(np.int32).ravel()
    start = np.zeros(cells + 1, np.int32)
    np.cumsum(np.bincount(cell, minlength=cells) * n_alpha, out=start[1:])
    return csr_array((shares.ravel(), index, start), (cells, columns))


@lru_cache(maxsize=16)
def projection_table(layout: Layout, votes: Votes = "hard") -> csr_array:
    """Return which bins the edges of all pairs of bins go to.

    Returns
    -------
    (n_theta * n_phi * n_alpha, n_theta * n_phi) sparse array of float32
        Row (theta, phi, alpha), column (theta', phi'); every row sums to 1.
    """
    edges = bin_edges(layout).reshape(-1, 3)
    theta, phi = line_angles(edges)
    places = (theta * layout.n_theta / np.pi, phi * layout.n_phi / np.pi)
    rows, columns, shares = (_hard if votes == "hard" else _interpolated)(*places, layout)
    shape = (len(edges), layout.n_theta * layout.n_phi)
    return csr_array((shares.astype(np.float32), (rows, columns)), shape)


def bin_edges(layout: Layout) -> NDArray[np.float64]:
    """Return A (cos alpha, sin alpha, 0) for the centres of all bins, (n_theta, n_phi, n_alpha, 3)."""
    theta = (np.arange(layout.n_theta) + 0.5) * (np.pi / 2 / layout.n_theta)
    phi = (np.arange(layout.n_phi) + 0.5) * (np.radians(layout.phi_range_deg) / layout.n_phi)
    alpha = (np.arange(layout.n_alpha) + 0.5) * (np.pi / layout.n_alpha)
    turns = rotation_to(theta[:, None], phi[None, :])
    edges = np.stack([np.cos(alpha), np.sin(alpha), np.zeros_like(alpha)], axis=-1)
    return np.einsum("tpij,aj->tpai", turns, edges)


def rotation_to(theta: NDArray, phi: NDArray) -> NDArray[np.float64]:
    """Return A: the smallest rotation of N_i = (0, 0, -1) to the normal at `theta`, `phi`.

    By `theta` about N_i x N = (sin phi, -cos phi, 0).

    Parameters
    ----------
    theta, phi : arrays that broadcast to one shape (...)
        Radians.

    Returns
    -------
    (..., 3, 3) array

    Examples
    --------
    >>> normal = rotation_to(np.pi / 2, 0.0) @ [0, 0, -1]
    >>> (normal.round(6) + 0).tolist()
    [1.0, 0.0, 0.0]
    """
    theta, phi = np.broadcast_arrays(np.asarray(theta, np.float64), np.asarray(phi, np.float64))
    axis = np.stack([np.sin(phi), -np.cos(phi), np.zeros_like(phi)], axis=-1)
    x, y, z = axis[..., 0], axis[..., 1], axis[..., 2]
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    cos, sin = np.cos(theta)[..., None, None], np.sin(theta)[..., None, None]
    return cos * np.eye(3) + sin * cross + (1 - cos) * axis[..., :, None] * axis[..., None, :]


def line_angles(edges: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return theta' in [0, pi] and phi' in [0, pi) of lines along (..., 3) vectors; e and -e are one.

    Examples
    --------
    >>> theta, phi = line_angles(np.array([[0, -1, 0], [0, 1, 0]]))
    >>> np.degrees(theta).tolist(), np.degrees(phi).tolist()
    ([90.0, 90.0], [90.0, 90.0])
    """
    # Rounded, so that a line that is in the plane but for rounding is on the same side every time.
    x, y, z = np.moveaxis(np.round(np.asarray(edges, np.float64), 12), -1, 0)
    other = (y < 0) | ((y == 0) & (x < 0)) | ((y == 0) & (x == 0) & (z > 0))
    x, y, z = (np.where(other, -part, part) + 0.0 for part in (x, y, z))
    return np.arctan2(np.hypot(x, y), -z), np.arctan2(y, x)


def _hard(theta: NDArray, phi: NDArray, layout: Layout) -> tuple[NDArray, NDArray, NDArray]:
    # Some edges lie on the border of two bins; rounding shall not decide which one.
    row = np.minimum((theta + 1e-9).astype(np.intp), layout.n_theta - 1)
    column = np.minimum((phi + 1e-9).astype(np.intp), layout.n_phi - 1)
    return np.arange(len(theta)), row * layout.n_phi + column, np.ones(len(theta))


def _interpolated(theta: NDArray, phi: NDArray, layout: Layout) -> tuple[NDArray, NDArray, NDArray]:
    """Share every vote among the four bins whose centres are around it.

    Past theta' = 0 comes theta' = 180 of the same phi'; past phi' = 0, phi' = 180 of 180 - theta'.
    """
    row, column = np.floor(theta - 0.5).astype(np.intp), np.floor(phi - 0.5).astype(np.intp)
    down, right = theta - 0.5 - row, phi - 0.5 - column
    rows, columns, shares = [], [], []
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        t, p = (row + i) % layout.n_theta, column + j
        t = np.where((p < 0) | (p >= layout.n_phi), layout.n_theta - 1 - t, t)
        rows.append(np.arange(len(theta)))
        columns.append(t * layout.n_phi + p % layout.n_phi)
        shares.append((down if i else 1 - down) * (right if j else 1 - right))
    return np.concatenate(rows), np.concatenate(columns), np.concatenate(shares)
