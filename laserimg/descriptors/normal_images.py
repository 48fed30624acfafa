"""The normal at every pixel of range images: from the gradient of the image, or of the surface itself.

Normals are unit vectors in the frame of the image, x right, y down, z away from the scanner, turned
to the scanner (z < 0); 0 where there is none.
"""

import numpy as np

from laserimg.descriptors.differences import slopes
from laserimg.scan import BoolArray, Float32Array

# Depth range of an object, in pixels, when eq. 1 is given no other scale. Measured on real objects: a
# scale that is too small loses a point of accuracy, a very large one encodes the size.
DEPTH_RANGE_PX = 16.0


def gradient_normals(
    depth: Float32Array, known: BoolArray, pixels_per_metre: float | None = None
) -> Float32Array:
    """Return the normals of range images by the paper's gradient formula.

    Parameters
    ----------
    depth : (n, h, w) array of float32
        d(x, y), metres.
    known : (n, h, w) array of bool
        Pixels of the object; no difference is taken across its edge.
    pixels_per_metre : float, optional
        Scale of d(x, y) in units of a pixel; by default the object's own depth range is
        16 pixels.

    Returns
    -------
    (n, h, w, 3) array of float32

    Notes
    -----
    Paper 1, section 3.4, eq. 1: N = (-dd/dx, -dd/dy, 1). Differs from the paper: N is turned to the
    scanner, (dd/dx, dd/dy, -1), which leaves the angles of eq. 2 and 3 as they are; d has a stated
    scale. The paper's d(x, y) is in units of the image, so that its angles depend on how the
    gray values were made and on the distance of the object: these are no directions in space.
    `surface_normals` are, and they are the default of the descriptors.

    Examples
    --------
    >>> ramp = np.arange(4, dtype=np.float32)[None, None].repeat(4, axis=1)
    >>> gradient_normals(ramp, np.ones((1, 4, 4), bool), 1.0)[0, 0, 0].round(3).tolist()
    [0.7070000171661377, 0.0, -0.7070000171661377]
    """
    depth = np.asarray(depth, np.float32)
    scaled = depth * (_own_scale(depth, known) if pixels_per_metre is None else np.float32(pixels_per_metre))
    across, has_across = slopes(scaled, known, axis=2)
    down, has_down = slopes(scaled, known, axis=1)
    normals = np.stack([across, down, np.full_like(across, -1)], axis=-1)
    return _unit(normals) * (known & has_across & has_down)[..., None]


def surface_normals(points: Float32Array, known: BoolArray) -> Float32Array:
    """Return the normals of the surface in space, from the points that the pixels show.

    Parameters
    ----------
    points : (n, h, w, 3) array of float32
        Metres, from the scanner, in the frame of the image.
    known : (n, h, w) array of bool
        Pixels of the object.

    Returns
    -------
    (n, h, w, 3) array of float32
        The cross product of the differences across and down; they have no unit and depend
        neither on the image's scale nor on the distance.
    """
    across, has_across = slopes(points, known, axis=2)
    down, has_down = slopes(points, known, axis=1)
    normals = _cross(down, across)
    away = np.einsum("nhwc,nhwc->nhw", normals, points) > 0
    normals[away] *= -1
    return _unit(normals) * (known & has_across & has_down)[..., None]


def _cross(first: Float32Array, second: Float32Array) -> Float32Array:
    """Cross product; numpy.cross takes three times as long."""
    (a, b, c), (x, y, z) = (np.moveaxis(np.asarray(part, np.float32), -1, 0) for part in (first, second))
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=-1)


def _own_scale(depth: Float32Array, known: BoolArray) -> Float32Array:
    far = np.where(known, depth, -np.inf).max(axis=(1, 2))
    near = np.where(known, depth, np.inf).min(axis=(1, 2))
    span = np.where(far > near, far - near, 1)
    return np.asarray(DEPTH_RANGE_PX / span, np.float32)[:, None, None]


def _unit(vectors: Float32Array) -> Float32Array:
    length = np.sqrt(np.einsum("...c,...c->...", vectors, vectors))[..., None]
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
