"""The second stage: a linear SVM that scores every proposed box of a class, and puts the box right."""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, iou
from laserimg.errors import LaserImgError, ModelError
from laserimg.files import read_bytes
from laserimg.formats.card import Card
from laserimg.readers.npz import load_arrays
from laserimg.scan import Float32Array

# Boxes of one class that overlap more than this are of one object.
SAME_IOU = 0.4
# A box is moved by at most this share of its sides, and grows or shrinks by at most this factor's logarithm.
MAX_MOVE = 0.5
_MAX_BYTES = 4 << 20
_NUMBERS = ("bias", "slope", "passed", "regions", "layout")
_SHAPES = {"weights": 1, "moves": 2, "still": 1, **dict.fromkeys(_NUMBERS, 0)}
# Another way of making vectors gets another number: a model is of one of them.
LAYOUT_NUMBER = 1


@dataclass(frozen=True, eq=False, slots=True)
class SecondStage:
    """A linear SVM on the vectors of `Describer`, and a linear correction of the box.

    The correction is that of R. Girshick et al., "Rich feature hierarchies for accurate object detection",
    CVPR 2014, doi:10.1109/CVPR.2014.81, appendix C, on these vectors in place of a network's.

    Parameters
    ----------
    name : str
    card : Card
    weights : (d,) array of float32
    bias : float
        The score is 0.5 at ``vector @ weights + bias == 0``.
    slope : float
        The score is ``1 / (1 + exp(-slope * (vector @ weights + bias)))`` (J. Platt, 1999).
    moves : (4, d) array of float32
    still : (4,) array of float32
        ``moves @ vector + still`` is how far the box's middle must go across and down, in its sides,
        and the logarithms of how much wider and higher it must be.
    passed : float
        Added to the logarithm of the odds of a box that passes all checks of its class.
    regions : bool
        Whether the rectangles of regions are proposed to it, beside what cascades propose.
    """

    name: str
    card: Card
    weights: Float32Array
    bias: float
    slope: float
    moves: Float32Array
    still: Float32Array
    passed: float = 0.0
    regions: bool = True

    def margins(self, vectors: Float32Array) -> NDArray[np.float64]:
        """Return ``vectors @ weights + bias`` (n,) of vectors (n, d)."""
        return (vectors @ self.weights).astype(np.float64) + self.bias

    def scores(self, margins: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the score (n,) of margins (n,), between 0 and 1."""
        return 1 / (1 + np.exp(np.clip(-self.slope * margins, -50, 50)))

    def corrected(self, boxes: Boxes, vectors: Float32Array) -> Boxes:
        """Return the boxes moved and resized."""
        change = np.clip((vectors @ self.moves.T).astype(np.float64) + self.still, -MAX_MOVE, MAX_MOVE)
        middle = boxes[:, :2] + boxes[:, 2:] * (0.5 + change[:, :2])
        size = boxes[:, 2:] * np.exp(change[:, 2:])
        return np.concatenate([middle - size / 2, size], axis=1)


def distinct(boxes: Boxes, scores: NDArray[np.float64], wrap_width: int | None) -> NDArray[np.intp]:
    """Return the places of boxes that overlap no better one by more than `SAME_IOU`, best first."""
    left = np.argsort(-scores, kind="stable")
    kept = []
    while len(left):
        kept.append(left[0])
        left = left[1:][iou(boxes[left[:1]], boxes[left[1:]], wrap_width)[0] <= SAME_IOU]
    return np.array(kept, np.intp)


def save_second_stage(stage: SecondStage) -> bytes:
    """Return the contents of a second stage's file."""
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        weights=stage.weights.astype(np.float16),
        bias=np.float32(stage.bias),
        slope=np.float32(stage.slope),
        moves=stage.moves.astype(np.float16),
        still=stage.still.astype(np.float32),
        passed=np.float32(stage.passed),
        regions=np.int32(stage.regions),
        layout=np.int32(LAYOUT_NUMBER),
    )
    return buffer.getvalue()


def load_second_stage(path: Path, card: Card) -> SecondStage:
    """Read a second stage.

    Raises
    ------
    ModelError
        If the file cannot be read, or an array is missing or wrong.
    """
    try:
        arrays = load_arrays(read_bytes(path, _MAX_BYTES), _MAX_BYTES)
    except LaserImgError as error:
        raise ModelError(f"{path}: {error}") from error
    for name, dimensions in _SHAPES.items():
        if name not in arrays or arrays[name].ndim != dimensions or not np.isfinite(arrays[name]).all():
            raise ModelError(f"{path}: {name} is missing or no finite array of {dimensions} dimensions")
    length = len(arrays["weights"])
    if arrays["moves"].shape != (4, length) or arrays["still"].shape != (4,):
        raise ModelError(f"{path}: weights, moves and still do not fit each other")
    if int(arrays["layout"]) != LAYOUT_NUMBER:
        raise ModelError(f"{path}: made for other vectors ({int(arrays['layout'])}); train it anew")
    single = {name: np.asarray(arrays[name], np.float32) for name in ("weights", "moves", "still")}
    return SecondStage(
        path.stem,
        card,
        bias=float(arrays["bias"]),
        slope=float(arrays["slope"]),
        passed=float(arrays["passed"]),
        regions=bool(arrays["regions"]),
        **single,
    )
