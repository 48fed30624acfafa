"""Many equally large windows, and the values of features on them, bit for bit as in OpenCV's detector."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from laserimg.cascade.features import Features, Mode
from laserimg.cascade.integral import inverse_norms, tilted_integrals, upright_integrals
from laserimg.errors import LaserImgError

# The cells round the middle one, clockwise from the top left, which holds the highest bit.
_RING = ((0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1))


@dataclass(frozen=True, eq=False, slots=True)
class Windows:
    """Integral images and normalisation of equally large grey windows.

    Attributes
    ----------
    corners : (k, n) int32
        A column is the integral image of a window row by row, (height + 1) * (width + 1) numbers, and after
        it, for mode "all", the integral image turned by 45 degrees. Corner by corner rather than window by
        window, because a feature adds few corners over all windows.
    inverse_norm : (n,) float32
        See `laserimg.cascade.integral.inverse_norms`.
    width, height : int
        Pixels.
    mode : str
        Which features can be measured.
    """

    corners: NDArray[np.int32]
    inverse_norm: NDArray[np.float32]
    width: int
    height: int
    mode: Mode

    @classmethod
    def of(cls, pixels: NDArray[np.uint8], mode: Mode) -> "Windows":
        """Return the windows of an (n, height, width) array of grey levels.

        Raises
        ------
        LaserImgError
            If the array has another shape or type.
        """
        if pixels.ndim != 3 or pixels.dtype != np.uint8:
            raise LaserImgError(f"windows must be (n, h, w) uint8, got {pixels.shape} {pixels.dtype}")
        parts = [upright_integrals(pixels)]
        if mode == "all":
            parts.append(tilted_integrals(pixels))
        _, height, width = pixels.shape
        flat = (len(pixels), (height + 1) * (width + 1))
        corners = np.concatenate([part.reshape(flat) for part in parts], axis=1)
        return cls(np.ascontiguousarray(corners.T), inverse_norms(pixels), width, height, mode)

    def __len__(self) -> int:
        return self.corners.shape[1]

    def measure(self, features: Features) -> NDArray:
        """Return the (features, windows) numbers OpenCV decides on: float32 values, for LBP uint8 codes.

        Differs from opencv_traincascade, which divides Haar values by the norm where the detector multiplies
        by its inverse: the last bit differs.
        """
        if self.mode == "lbp":
            return self._lbp_codes(features.rects[:, 0].astype(np.int64))
        matrix = corner_matrix(features, self.width, self.height, self.corners.shape[0])
        # Weighted sums are whole numbers below 2**24 up to 64 x 64 pixels: exact in int32 and in float32.
        return (matrix @ self.corners).astype(np.float32) * self.inverse_norm

    def _lbp_codes(self, cells: NDArray[np.int64]) -> NDArray[np.uint8]:
        x, y, w, h = cells.T
        middle = self._sums(x + w, y + h, w, h)
        codes = np.zeros(middle.shape, np.uint8)
        for across, down in _RING:
            codes <<= 1
            codes |= self._sums(x + across * w, y + down * h, w, h) >= middle
        return codes

    def _sums(self, x: NDArray, y: NDArray, w: NDArray, h: NDArray) -> NDArray[np.int32]:
        top, bottom = y * (self.width + 1), (y + h) * (self.width + 1)
        corner = self.corners
        return corner[top + x] - corner[top + x + w] - corner[bottom + x] + corner[bottom + x + w]


def corner_matrix(features: Features, width: int, height: int, size: int) -> sparse.csr_array:
    """Return the (features, size) int32 matrix that turns corners into weighted pixel sums."""
    used = features.weights != 0
    row, which = np.nonzero(used)
    rects = features.rects[row, which].astype(np.int64)
    offset = np.where(features.tilted[row], (width + 1) * (height + 1), 0)
    column = offset[:, None] + _corners(rects, features.tilted[row], width)
    weight = features.weights[row, which].astype(np.int32)
    data = weight[:, None] * np.array([1, -1, -1, 1], np.int32)
    coordinates = (np.repeat(row, 4), column.ravel())
    return sparse.csr_array((data.ravel(), coordinates), shape=(len(features), size))


def _corners(rects: NDArray, tilted: NDArray, width: int) -> NDArray:
    x, y, w, h = rects.T
    upright = np.stack([x + y * (width + 1), x + w + y * (width + 1)], axis=1)
    upright = np.concatenate([upright, upright + (h * (width + 1))[:, None]], axis=1)
    across = np.stack([x, x - h, x + w, x + w - h], axis=1)
    down = np.stack([y, y + h, y + w, y + w + h], axis=1)
    return np.where(tilted[:, None], across + down * (width + 1), upright)
