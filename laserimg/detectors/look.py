"""One look of a second stage: a linear SVM that scores boxes, a linear correction that puts them right."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes
from laserimg.scan import Float32Array

# A box is moved by at most this share of its sides, and grows or shrinks by at most this factor's logarithm.
MAX_MOVE = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class Look:
    """A linear SVM on the vectors of boxes, and a linear correction of the boxes.

    The correction is that of R. Girshick et al., "Rich feature hierarchies for accurate object detection",
    CVPR 2014, doi:10.1109/CVPR.2014.81, appendix C, on these vectors in place of a network's.

    Parameters
    ----------
    weights : (d,) array of float32
    bias : float
    moves : (4, d) array of float32
    still : (4,) array of float32
        ``moves @ vector + still`` is how far the box's middle must go across and down, in its sides,
        and the logarithms of how much wider and higher it must be.
    """

    weights: Float32Array
    bias: float
    moves: Float32Array
    still: Float32Array

    def margins(self, vectors: Float32Array) -> NDArray[np.float64]:
        """Return ``vectors @ weights + bias`` (n,) of vectors (n, d)."""
        return (vectors @ self.weights).astype(np.float64) + self.bias

    def corrected(self, boxes: Boxes, vectors: Float32Array) -> Boxes:
        """Return the boxes (n, 4) moved and resized as their vectors (n, d) say."""
        change = np.clip((vectors @ self.moves.T).astype(np.float64) + self.still, -MAX_MOVE, MAX_MOVE)
        middle = boxes[:, :2] + boxes[:, 2:] * (0.5 + change[:, :2])
        size = boxes[:, 2:] * np.exp(change[:, 2:])
        return np.concatenate([middle - size / 2, size], axis=1)
