"""What labels in three dimensions say: boxes, and where there would be boxes if there were objects."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, slots=True)
class Box3D:
    """A labelled object as an oriented box.

    Parameters
    ----------
    kind : str
        The data set's own name of the class, in lower case.
    centre : (3,) array
        Metres, in the frame of the file's points (`Scan.world_from_scan` leads to it).
    axes : (3, 3) array
        Rotation whose columns are the directions of length, width and height.
    size : (3,) array
        Length, width and height in metres.
    """

    kind: str
    centre: FloatArray
    axes: FloatArray
    size: FloatArray

    def holds(self, points: ArrayLike, margin_m: float = 0.0) -> BoolArray:
        """Return which of the (..., 3) points lie in the box, grown on every side by a margin.

        Examples
        --------
        >>> box = Box3D("car", np.array([5.0, 0, 1]), np.eye(3), np.array([4.0, 2, 2]))
        >>> box.holds([[3.1, 0.9, 0.1], [3.1, 1.1, 0.1]]).tolist()
        [True, False]
        """
        local = (np.asarray(points, np.float64) - self.centre) @ self.axes
        return np.asarray((np.abs(local) <= self.size / 2 + margin_m).all(axis=-1))


@dataclass(frozen=True, eq=False, slots=True)
class CameraView:
    """The part of the world that a camera sees.

    Parameters
    ----------
    projection : (3, 4) array
        From homogeneous points in the file's frame to pixels.
    width, height : int
        Of the camera's image, in pixels.
    """

    projection: FloatArray
    width: int
    height: int

    def pixels(self, points: ArrayLike) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Return column, row, and whether the camera sees them, of (..., 3) points."""
        array = np.asarray(points, np.float64)
        u, v, depth = np.moveaxis(array @ self.projection[:, :3].T + self.projection[:, 3], -1, 0)
        before = depth > 0
        safe = np.where(before, depth, 1.0)
        u, v = u / safe, v / safe
        return u, v, before & (u >= 0) & (u < self.width) & (v >= 0) & (v < self.height)


@dataclass(frozen=True, eq=False, slots=True)
class Labels3D:
    """The labels of one file.

    Parameters
    ----------
    boxes : tuple of Box3D
    view : CameraView or None
        Only objects in it are labelled; None when the labels are all round.
    unlabelled : (n, 4) array
        Left, top, right and bottom in the camera's pixels of parts where objects have no box.
    """

    boxes: tuple[Box3D, ...]
    view: CameraView | None = None
    unlabelled: FloatArray | None = None
