"""The window of a HOG detector and how it is divided."""

from dataclasses import dataclass
from typing import Any

import cv2

from laserimg.detectors.hog import MAX_BINS, MAX_SIDE
from laserimg.errors import ConfigError

Size = tuple[int, int]


@dataclass(frozen=True)
class HogWindow:
    """A window of blocks of cells, each cell with a histogram of gradient directions.

    N. Dalal and B. Triggs, "Histograms of oriented gradients for human detection", CVPR 2005,
    doi:10.1109/CVPR.2005.177. Their window for people is the default.

    Attributes
    ----------
    window, cell, block, stride : (int, int)
        Width and height in pixels; blocks overlap where the stride is less than the block.
    bins : int
        Directions of a histogram.
    signed : bool
        Directions go round the full turn: dark on light is not light on dark.

    Examples
    --------
    >>> HogWindow().descriptor().getDescriptorSize()
    3780
    >>> HogWindow((24, 24), cell=(5, 5))
    Traceback (most recent call last):
    laserimg.errors.ConfigError: a block of 16x16 is not made of cells of 5x5
    """

    window: Size = (64, 128)
    cell: Size = (8, 8)
    block: Size = (16, 16)
    stride: Size = (8, 8)
    bins: int = 9
    signed: bool = False

    def __post_init__(self) -> None:
        for name in ("window", "cell", "block", "stride"):
            if not all(1 <= side <= MAX_SIDE for side in getattr(self, name)):
                raise ConfigError(f"{name} must be 1 to {MAX_SIDE} pixels, got {_text(getattr(self, name))}")
        if not 1 <= self.bins <= MAX_BINS:
            raise ConfigError(f"bins must be 1 to {MAX_BINS}, got {self.bins}")
        window, cell, block, stride = map(_text, (self.window, self.cell, self.block, self.stride))
        for axis in range(2):
            if self.block[axis] % self.cell[axis]:
                raise ConfigError(f"a block of {block} is not made of cells of {cell}")
            rest = self.window[axis] - self.block[axis]
            if rest < 0 or rest % self.stride[axis]:
                raise ConfigError(
                    f"blocks of {block} by steps of {stride} do not end with a window of {window}"
                )

    @property
    def arguments(self) -> dict[str, Any]:
        """All arguments of `cv2.HOGDescriptor` by name, in its order."""
        return {
            "winSize": self.window,
            "blockSize": self.block,
            "blockStride": self.stride,
            "cellSize": self.cell,
            "nbins": self.bins,
            "derivAperture": 1,
            "winSigma": -1.0,
            "histogramNormType": int(cv2.HOGDESCRIPTOR_L2HYS),
            "L2HysThreshold": 0.2,
            "gammaCorrection": True,
            "nlevels": int(cv2.HOGDESCRIPTOR_DEFAULT_NLEVELS),
            "signedGradient": self.signed,
        }

    def descriptor(self) -> cv2.HOGDescriptor:
        """Return OpenCV's descriptor of such windows, without an SVM."""
        return cv2.HOGDescriptor(*self.arguments.values())


def _text(size: Size) -> str:
    return f"{size[0]}x{size[1]}"
