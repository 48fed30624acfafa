"""The second stage: looks at every proposed box of a class, puts it right, and says how sure it is."""

import io
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, iou
from laserimg.detectors.boosted_trees import BoostedTrees
from laserimg.detectors.description import VECTOR_LENGTH, Describer, plain_part
from laserimg.detectors.look import Look
from laserimg.detectors.metric_cells import METRIC_NUMBERS, metric_cells
from laserimg.errors import LaserImgError, ModelError
from laserimg.files import read_bytes
from laserimg.formats.card import Card
from laserimg.readers.npz import load_arrays
from laserimg.scan import Float32Array

# Boxes of one class that overlap more than this are of one object. With 0.4 average precision of office
# chairs in simulated scans, where they stand in rows, was lower by 0.01, with 0.6 too.
SAME_IOU = 0.5
# So many boxes of a class are looked at more than once.
MOST = 60
_MAX_BYTES = 4 << 20
_NUMBERS = ("slope", "lean", "shift", "passed", "regions", "layout")
_TREES = {"features": 2, "thresholds": 2, "answers": 2}
_SHAPES = {"weights": 2, "bias": 1, "moves": 3, "still": 2, **_TREES, **dict.fromkeys(_NUMBERS, 0)}
# Another way of making vectors gets another number: a model is of one of them.
LAYOUT_NUMBER = 3


@dataclass(frozen=True, eq=False, slots=True)
class SecondStage:
    """Some looks, each at the boxes as the look before has put them, and trees that judge what they saw.

    Each look is trained on boxes as it gets them, as in Z. Cai and N. Vasconcelos, "Cascade R-CNN", CVPR
    2018, doi:10.1109/CVPR.2018.00644, with linear machines in place of a network.

    Parameters
    ----------
    name : str
    card : Card
    looks : tuple of Look
    judge : BoostedTrees
        On the numbers of `seen`.
    slope, lean, shift : float
        The logarithm of the odds of a box is ``slope * judge(numbers) + lean * mean + shift`` with the mean
        of the margins of all looks (J. Platt, 1999, with two numbers). The judge does not see the margins:
        on the samples that it learns from, which are also those of the looks, they are too good to be true.
    passed : float
        Added to the logarithm of the odds of a box that passes all checks of its class.
    regions : bool
        Whether the rectangles of regions are proposed to it, beside what cascades propose.
    """

    name: str
    card: Card
    looks: tuple[Look, ...]
    judge: BoostedTrees
    slope: float = 1.0
    lean: float = 0.0
    shift: float = 0.0
    passed: float = 0.0
    regions: bool = True

    def scores(self, sums: NDArray[np.float64], means: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the score (n,), between 0 and 1, of sums of the judge (n,) and means of the margins (n,)."""
        odds = self.slope * sums + self.lean * means + self.shift
        return 1 / (1 + np.exp(np.clip(-odds, -50, 50)))

    def if_passed(self, scores: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what scores (n,) become of candidates that pass all checks of their class."""
        better = scores * np.exp(self.passed)
        return better / (1 - scores + better)

    def looked_at(
        self, describe: Describer, boxes: Boxes, vectors: Float32Array
    ) -> tuple[NDArray[np.intp], Boxes, NDArray[np.float64], NDArray[np.float64]]:
        """Return the most promising boxes after all looks, and what the judge and the looks say of them.

        Parameters
        ----------
        describe : Describer
        boxes : (n, 4) array
        vectors : (n, d) array
            As `describe` gives them.

        Returns
        -------
        places : (m,) array
            Which of the boxes they were.
        boxes : (m, 4) array
        sums : (m,) array
            Of the judge.
        means : (m,) array
            Of the margins.
        """
        margins = self.looks[0].margins(vectors)
        places = np.argsort(-margins, kind="stable")[:MOST]
        boxes, vectors, margins = boxes[places], vectors[places], [margins[places]]
        for look, following in pairwise(self.looks):
            boxes = look.corrected(boxes, vectors)
            vectors = describe(boxes)
            margins.append(following.margins(vectors))
        sums = self.judge(seen(describe, boxes, vectors))
        return places, self.looks[-1].corrected(boxes, vectors), sums, np.mean(margins, axis=0)


def seen(describe: Describer, boxes: Boxes, vectors: NDArray[np.floating]) -> Float32Array:
    """Return what a second stage judges boxes by: their plain numbers and those in metres.

    Parameters
    ----------
    describe : Describer
    boxes : (n, 4) array
        As the last look gets them.
    vectors : (n, d) array
        As `describe` gives them.

    Returns
    -------
    (n, e) array of float32
    """
    in_metres = metric_cells(describe.evidence, describe.ranges, boxes)
    return np.concatenate([plain_part(vectors), in_metres], axis=1, dtype=np.float32)


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
    looks, judge, buffer = stage.looks, stage.judge, io.BytesIO()
    np.savez_compressed(
        buffer,
        weights=np.stack([look.weights for look in looks]).astype(np.float16),
        bias=np.array([look.bias for look in looks], np.float32),
        moves=np.stack([look.moves for look in looks]).astype(np.float16),
        still=np.stack([look.still for look in looks]).astype(np.float32),
        features=judge.features,
        thresholds=judge.thresholds,
        answers=judge.answers,
        slope=np.float32(stage.slope),
        lean=np.float32(stage.lean),
        shift=np.float32(stage.shift),
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
    if "layout" in arrays and arrays["layout"].ndim == 0 and arrays["layout"] != LAYOUT_NUMBER:
        raise ModelError(f"{path}: made for other vectors ({arrays['layout']}); train it anew")
    for name, dimensions in _SHAPES.items():
        if name not in arrays or arrays[name].ndim != dimensions or not _are_numbers(name, arrays[name]):
            raise ModelError(f"{path}: {name} is missing or no finite array of {dimensions} dimensions")
    return SecondStage(
        path.stem,
        card,
        _looks(path, arrays),
        _judge(path, arrays),
        slope=float(arrays["slope"]),
        lean=float(arrays["lean"]),
        shift=float(arrays["shift"]),
        passed=float(arrays["passed"]),
        regions=bool(arrays["regions"]),
    )


def _are_numbers(name: str, array: NDArray) -> bool:
    # Where a tree has no question, its threshold is infinite.
    return bool(np.isfinite(np.where(array == np.inf, 0, array) if name == "thresholds" else array).all())


def _looks(path: Path, arrays: dict[str, NDArray]) -> tuple[Look, ...]:
    count, length = arrays["weights"].shape
    shapes = arrays["bias"].shape, arrays["moves"].shape, arrays["still"].shape
    if shapes != ((count,), (count, 4, length), (count, 4)) or count == 0:
        raise ModelError(f"{path}: weights, moves and still do not fit each other")
    if length != VECTOR_LENGTH:
        raise ModelError(f"{path}: is for vectors of {length} numbers, those here have {VECTOR_LENGTH}")
    weights, moves, still = (np.asarray(arrays[name], np.float32) for name in ("weights", "moves", "still"))
    return tuple(
        Look(weights[i], float(bias), moves[i], still[i]) for i, bias in enumerate(arrays["bias"].tolist())
    )


def _judge(path: Path, arrays: dict[str, NDArray]) -> BoostedTrees:
    features = np.asarray(arrays["features"], np.int32)
    length = arrays["weights"].shape[1]
    numbers = plain_part(np.empty((0, length), np.float32)).shape[1] + METRIC_NUMBERS
    if features.size and not 0 <= features.min() <= features.max() < numbers:
        raise ModelError(f"{path}: its trees ask for other numbers than the {numbers} there are")
    try:
        return BoostedTrees(
            features, np.asarray(arrays["thresholds"], np.float32), np.asarray(arrays["answers"], np.float32)
        )
    except ValueError as error:
        raise ModelError(f"{path}: {error}") from error
