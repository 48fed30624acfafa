"""Windows with a frame of one pixel, so that gradients at their edges are those of the image around them.

A detector sees a window within its image; of a crop OpenCV finds no gradient across its edges, and an SVM
trained on crops learns edges that no image has.
"""

from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
from numpy.typing import NDArray

FRAME = 1
# Windows a thread describes at a time.
_BATCH = 256


def framed(windows: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return windows with a frame that carries on their two outermost pixels in a straight line.

    Parameters
    ----------
    windows : (n, height, width) uint8

    Returns
    -------
    (n, height + 2, width + 2) uint8

    Examples
    --------
    >>> framed(np.array([[[20, 30], [40, 50]]], np.uint8))[0].tolist()
    [[0, 0, 10, 20], [10, 20, 30, 40], [30, 40, 50, 60], [50, 60, 70, 80]]
    """
    margins = ((0, 0), (FRAME, FRAME), (FRAME, FRAME))
    padded = np.pad(windows.astype(np.int16), margins, mode="reflect", reflect_type="odd")
    return padded.clip(0, 255).astype(np.uint8)


def describe(
    descriptor: cv2.HOGDescriptor, frames: NDArray[np.uint8], jobs: ThreadPoolExecutor | None = None
) -> NDArray[np.float32]:
    """Return the (n, values) descriptors of framed windows, as the detector sees them in their images.

    Parameters
    ----------
    descriptor : cv2.HOGDescriptor
    frames : (n, height + 2, width + 2) uint8
    jobs : ThreadPoolExecutor, optional
    """
    values = np.empty((len(frames), descriptor.getDescriptorSize()), np.float32)

    def fill(start: int) -> None:
        for number in range(start, min(start + _BATCH, len(frames))):
            described = descriptor.compute(frames[number], locations=[(FRAME, FRAME)])
            values[number] = np.ravel(described)

    starts = range(0, len(frames), _BATCH)
    list(jobs.map(fill, starts) if jobs else map(fill, starts))
    return values
