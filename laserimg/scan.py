"""The scan: a grid of rays from one origin, with a range and a direction each."""

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.errors import ScanError

Float32Array = NDArray[np.float32]
BoolArray = NDArray[np.bool_]

# 16 times the largest terrestrial scans; a header that asks for more is broken.
MAX_PIXELS = 1 << 30


@dataclass(frozen=True, eq=False, slots=True)
class Scan:
    """One organised measurement from one origin.

    Frame: x forward, y left, z up, metres. Row 0 is the upper end of the beam fan; columns run
    left to right as seen from the scanner (azimuth decreasing). Arrays are copied if needed,
    validated and made read-only.

    Parameters
    ----------
    range : (H, W) array of float32
        Metres along the ray; 0 where nothing returned.
    directions : (H, W, 3) array of float32
        Unit vectors in the scanner's frame, also where nothing returned.
    reflectance : (H, W) array of float32, optional
        The sensor's own values; their unit and limits are unknown.
    world_from_scan : (4, 4) array of float64
        Pose of the scanner; identity when unknown. "Up" is world z.
    wraps : bool
        The columns close a full turn: the last is a neighbour of the first.
    filled : (H, W) array of bool, optional
        Rays without a return of their own that lie in a one-pixel gap of a projected point set.
    min_range, max_range : float
        Returns outside these metres are not `valid`; they stay in `range`.
    source : str
        The file it came from.
    index : int
        Its number among the scans of that file.

    Raises
    ------
    ScanError
        If the shapes differ, a value is not finite, a range is negative, a direction is not a
        unit vector, the grid has fewer than 2 rows or columns, or nothing returned.

    Examples
    --------
    >>> scan = Scan.from_range_image(np.full((3, 4), 2.0), np.radians([3, 1, -1, -3]), np.radians([2, 0, -2]))
    >>> scan.shape, scan.wraps
    ((3, 4), False)
    >>> scan.points()[1, 0].round(3)
    array([1.997, 0.105, 0.   ], dtype=float32)
    """

    range: Float32Array
    directions: Float32Array
    reflectance: Float32Array | None = None
    world_from_scan: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    wraps: bool = False
    filled: BoolArray | None = None
    min_range: float = 0.0
    max_range: float = float("inf")
    source: str = ""
    index: int = 0

    def __post_init__(self) -> None:
        shape = np.shape(self.range)
        if len(shape) != 2 or min(shape) < 2:
            raise ScanError(f"a scan needs a grid of at least 2 rows and 2 columns, got {shape}")
        self._freeze("range", np.float32, shape)
        self._freeze("directions", np.float32, (*shape, 3))
        self._freeze("world_from_scan", np.float64, (4, 4))
        if self.reflectance is not None:
            self._freeze("reflectance", np.float32, shape)
        if self.filled is not None:
            self._freeze("filled", np.bool_, shape)
        self._check_values()

    def _freeze(self, name: str, dtype: type, shape: tuple[int, ...]) -> None:
        array = np.ascontiguousarray(getattr(self, name), dtype=dtype)
        if array.shape != shape:
            raise ScanError(f"{name} must be {shape}, got {array.shape}")
        if array.flags.writeable:
            array = array.view()
            array.setflags(write=False)
        object.__setattr__(self, name, array)

    def _check_values(self) -> None:
        for name in ("range", "directions", "world_from_scan", "reflectance"):
            array = getattr(self, name)
            if array is not None and not np.isfinite(array).all():
                raise ScanError(f"{name} holds values that are not finite")
        if float(self.range.min()) < 0:
            raise ScanError(f"range holds {self.range.min():.3f} m; no return is written as 0")
        if not (self.range > 0).any():
            raise ScanError("no ray has a return")
        length_squared = np.einsum("ijk,ijk->ij", self.directions, self.directions)
        if float(np.abs(length_squared - 1).max()) > 1e-3:
            raise ScanError("directions must be unit vectors")
        if not 0 <= self.min_range < self.max_range:
            raise ScanError(f"min_range {self.min_range} must be below max_range {self.max_range}")

    @classmethod
    def from_range_image(
        cls, range_m: ArrayLike, azimuth: ArrayLike, elevation: ArrayLike, **fields: Any
    ) -> Self:
        """Make a scan from a range image and the angles of its columns and rows.

        Parameters
        ----------
        range_m : (H, W) array
            Metres; 0, NaN or infinity where nothing returned.
        azimuth : (W,) or (H, W) array
            Radians, counter-clockwise seen from above.
        elevation : (H,) or (H, W) array
            Radians, positive upwards.
        **fields
            Other fields of `Scan`, such as ``reflectance`` or ``wraps``.

        Notes
        -----
        Rows that go up and columns that go left are flipped (`right_way_round`).

        Raises
        ------
        ScanError
            If the shapes do not fit each other.
        """
        from laserimg.projection import directions_from_angles

        range_array = np.array(range_m, dtype=np.float32)
        range_array[~np.isfinite(range_array)] = 0
        return cls(range_array, directions_from_angles(azimuth, elevation), **fields).right_way_round()

    @classmethod
    def from_points(
        cls,
        xyz: ArrayLike,
        origin: ArrayLike = (0.0, 0.0, 0.0),
        reflectance: ArrayLike | None = None,
        shape: tuple[int, int] | None = None,
        pitch: float | None = None,
        fill_gaps: bool = False,
        **fields: Any,
    ) -> Self:
        """Make a scan from points in any order, by projection onto a spherical grid.

        The nearest return of every ray wins; `filled` marks the one-pixel gaps.

        Parameters
        ----------
        xyz : (N, 3) array
            Metres, z up.
        origin : (3,) array
            Where the scanner stood, in the frame of the points.
        reflectance : (N,) array, optional
        shape : (int, int), optional
            Rows and columns of the grid.
        pitch : float, optional
            Radians from ray to ray, when no `shape` is given; else estimated from the points.
        fill_gaps : bool
            Give the rays in `filled` the mean range of their neighbours instead of none.
        **fields
            Further fields of `Scan`; ``world_from_scan`` is the place of `origin` unless given.

        Raises
        ------
        ScanError
            If the points make no grid of at least 2 rows and columns.

        Examples
        --------
        >>> Scan.from_points([[4, 1, 0], [2, 0, 0], [4, -1, 1]], pitch=0.2).shape
        (2, 3)
        """
        from laserimg.projection import project

        grid = project(xyz, origin, reflectance, shape, pitch, fill_gaps)
        pose = np.eye(4)
        pose[:3, 3] = origin
        fields.setdefault("world_from_scan", pose)
        return cls(
            grid.range, grid.directions, grid.reflectance, filled=grid.filled, wraps=grid.wraps, **fields
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the grid."""
        height, width = self.range.shape
        return height, width

    @property
    def valid(self) -> BoolArray:
        """(H, W) mask of the returns between `min_range` and `max_range`."""
        return self.counts(self.range)

    def counts(self, range_m: Float32Array) -> BoolArray:
        """Return which ranges are returns between `min_range` and `max_range`; `valid` for a part of them."""
        return (range_m > 0) & (range_m >= self.min_range) & (range_m <= self.max_range)

    @property
    def up(self) -> NDArray[np.float64]:
        """(3,) unit vector: world z in the scanner's frame."""
        return self.world_from_scan[2, :3].copy()

    def points(self) -> Float32Array:
        """(H, W, 3) Cartesian points in metres; the origin where nothing returned.

        "Polar coordinates are transformed into Cartesian coordinates": paper 2, section 3.
        """
        return self.range[..., None] * self.directions

    def right_way_round(self) -> Self:
        """Return the scan with row 0 at the upper end and azimuth decreasing with the column.

        What files and arrays hold in another order is flipped. A scan whose pose turns it stays: the
        scanner may hang upside down.
        """
        if not np.array_equal(self.world_from_scan[:3, :3], np.eye(3)):
            return self
        height = self.directions[..., 2].astype(np.float64)
        middle = len(height) // 2
        rows = slice(None, None, -1 if height[:middle].mean() < height[-middle:].mean() else 1)
        some = self.directions[:: max(1, len(height) // 32)].astype(np.float64)
        turning = np.cross(some[:, :-1], some[:, 1:])[..., 2]
        columns = slice(None, None, -1 if turning.sum() > 0 else 1)
        if rows.step == columns.step == 1:
            return self
        grids = {name: getattr(self, name) for name in ("range", "directions", "reflectance", "filled")}
        return replace(
            self, **{name: grid[rows, columns] for name, grid in grids.items() if grid is not None}
        )

    def with_limits(self, min_range: float | None = None, max_range: float | None = None) -> Self:
        """Return the same scan with other limits of `valid`; None keeps the present one."""
        return replace(
            self,
            min_range=self.min_range if min_range is None else min_range,
            max_range=self.max_range if max_range is None else max_range,
        )
