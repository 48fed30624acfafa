"""The Haar and LBP features of OpenCV's trainer: every kind at every size and place in a window."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ConfigError

Mode = Literal["basic", "core", "all", "lbp"]
MODES: tuple[Mode, ...] = ("basic", "core", "all", "lbp")
MIN_SIDE, MAX_SIDE = 12, 64


@dataclass(frozen=True)
class Kind:
    """One form of feature on a grid of cells: rectangles in cells, their weights, upright or tilted.

    A tilted rectangle hangs from its top corner: width runs down right, height down left.
    """

    name: str
    cells: tuple[int, int]
    rects: tuple[tuple[int, int, int, int], ...]
    weights: tuple[float, ...]
    tilted: bool = False


def _line(name: str, cells: int, inner: tuple[int, int], weight: float, tilted: bool) -> tuple[Kind, Kind]:
    first, count = inner
    return (
        Kind(f"x{name}", (cells, 1), ((0, 0, cells, 1), (first, 0, count, 1)), (-1, weight), tilted),
        Kind(f"y{name}", (1, cells), ((0, 0, 1, cells), (0, first, 1, count)), (-1, weight), tilted),
    )


def kinds(mode: Mode, zero_mean: bool = False) -> tuple[Kind, ...]:
    """Return the kinds of feature of a mode.

    Parameters
    ----------
    mode : "basic" | "core" | "all" | "lbp"
        OpenCV's BASIC, CORE, ALL (with the tilted ones) and LBP.
    zero_mean : bool
        Weigh the middle of the upright three-part features by 3, as Viola and Jones define them; OpenCV
        weighs it by 2 there, so that those features answer to plain brightness.

    Examples
    --------
    >>> [kind.name for kind in kinds("basic")]
    ['x2', 'y2', 'x3', 'y3', 'x2y2']
    """
    if mode == "lbp":
        return (Kind("lbp", (3, 3), ((0, 0, 1, 1),), (1,)),)
    middle = 3.0 if zero_mean else 2.0
    basic = (*_line("2", 2, (1, 1), 2, False), *_line("3", 3, (1, 1), middle, False))
    diagonal = Kind("x2y2", (2, 2), ((0, 0, 2, 2), (0, 0, 1, 1), (1, 1, 1, 1)), (-1, 2, 2))
    if mode == "basic":
        return (*basic, diagonal)
    centre = Kind("x3y3", (3, 3), ((0, 0, 3, 3), (1, 1, 1, 1)), (-1, 9))
    core = (*basic, *_line("4", 4, (1, 2), 2, False), diagonal, centre)
    if mode == "core":
        return core
    tilted = (
        *_line("2", 2, (0, 1), 2, True),
        *_line("3", 3, (1, 1), 3, True),
        *_line("4", 4, (1, 2), 2, True),
    )
    return (*core, *tilted)


@dataclass(frozen=True, eq=False, slots=True)
class Features:
    """Some features of one window: up to three weighted rectangles each.

    Attributes
    ----------
    rects : (n, 3, 4) int16
        ``x, y, w, h`` in the window; a rectangle that is not there is all 0. For LBP the first one is the
        first of the 3 x 3 cells.
    weights : (n, 3) float32
    tilted : (n,) bool
    """

    rects: NDArray[np.int16]
    weights: NDArray[np.float32]
    tilted: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.tilted)

    def __getitem__(self, chosen: NDArray | slice) -> "Features":
        return Features(self.rects[chosen], self.weights[chosen], self.tilted[chosen])


# Kind, x, y, cell width, cell height: move a feature, or move one of its sides.
_STEPS = np.array(
    [(0, s, 0, 0, 0) for s in (1, -1)]
    + [(0, 0, s, 0, 0) for s in (1, -1)]
    + [(0, a, 0, s, 0) for s in (1, -1) for a in (0, -s)]
    + [(0, 0, a, 0, s) for s in (1, -1) for a in (0, -s)]
)


@dataclass(frozen=True)
class Pool:
    """All features of a mode in a window, numbered; the numbers need no table of features.

    Number order: kind, cell width, cell height, y, x. A window of 64 x 64 holds millions of features, so
    rectangles are made only for the numbers asked for.

    Examples
    --------
    >>> len(Pool("basic", 20, 20)), len(Pool("all", 24, 24)), len(Pool("lbp", 20, 20))
    (78460, 261600, 3969)
    >>> Pool("basic", 20, 20)[np.array([0])].rects[0, :2].tolist()
    [[0, 0, 2, 1], [1, 0, 1, 1]]
    """

    mode: Mode
    width: int
    height: int
    zero_mean: bool = False

    def __post_init__(self) -> None:
        if self.mode not in MODES:
            raise ConfigError(f"features must be one of {', '.join(MODES)}, got {self.mode}")
        if not (MIN_SIDE <= self.width <= MAX_SIDE and MIN_SIDE <= self.height <= MAX_SIDE):
            raise ConfigError(
                f"window {self.width}x{self.height}: sides must be {MIN_SIDE} to {MAX_SIDE} pixels"
            )

    @cached_property
    def kinds(self) -> tuple[Kind, ...]:
        """The kinds of the mode."""
        return kinds(self.mode, self.zero_mean)

    @cached_property
    def shapes(self) -> NDArray[np.int64]:
        """A row a kind and cell size: kind, cell width and height, first x, places across and down."""
        rows = []
        for number, kind in enumerate(self.kinds):
            across, down = kind.cells
            for dx in range(1, self.width + 1):
                for dy in range(1, self.height + 1):
                    w, h = across * dx, down * dy
                    # A tilted feature reaches h to the left of its top corner and w to the right.
                    left, tall = (h, w + h) if kind.tilted else (0, h)
                    nx, ny = self.width - w - left + 1, self.height - tall + 1
                    if nx > 0 and ny > 0:
                        rows.append((number, dx, dy, left, nx, ny))
        return np.array(rows, np.int64)

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """Number of the first feature of every shape, and the count of all features at the end."""
        return np.concatenate([[0], np.cumsum(self.shapes[:, 4] * self.shapes[:, 5])])

    def __len__(self) -> int:
        return int(self.starts[-1])

    def __getitem__(self, numbers: NDArray[np.integer]) -> Features:
        kind, x, y, dx, dy = self.places(numbers).T
        origin = np.stack([x, y], axis=1)
        cells, weights, tilted = self._tables
        rects = cells[kind] * np.stack([dx, dy, dx, dy], axis=1)[:, None, :]
        rects[..., :2] = _places(rects[..., :2], tilted[kind])
        rects[..., :2] += np.where(rects[..., 2:3] > 0, origin[:, None, :], 0)
        return Features(rects.astype(np.int16), weights[kind], tilted[kind])

    def places(self, numbers: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return kind, x, y, cell width and cell height of features by their numbers, (n, 5)."""
        shape = np.searchsorted(self.starts, numbers, side="right") - 1
        kind, dx, dy, left, nx, _ = self.shapes[shape].T
        place = numbers - self.starts[shape]
        return np.stack([kind, left + place % nx, place // nx, dx, dy], axis=1)

    def numbers(self, places: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the numbers of the features at places (see `places`), without those outside the window.

        Examples
        --------
        >>> pool = Pool("basic", 20, 20)
        >>> pool.numbers(pool.places(np.array([7, 70000]))).tolist()
        [7, 70000]
        """
        kind, x, y, dx, dy = places.T
        inside = (dx > 0) & (dy > 0) & (dx <= self.width) & (dy <= self.height)
        shape = np.where(inside, self._shape_of[kind, dx * inside, dy * inside], -1)
        _, _, _, left, nx, ny = self.shapes[shape].T
        legal = (shape >= 0) & (x >= left) & (x < left + nx) & (y >= 0) & (y < ny)
        return (self.starts[shape] + x - left + y * nx)[legal]

    def neighbours(self, numbers: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the numbers of the features one pixel away in place or cell size, ascending, each once."""
        return np.unique(self.numbers((self.places(numbers)[:, None] + _STEPS).reshape(-1, 5)))

    @cached_property
    def _shape_of(self) -> NDArray[np.int64]:
        table = np.full((len(self.kinds), self.width + 1, self.height + 1), -1, np.int64)
        table[tuple(self.shapes[:, :3].T)] = np.arange(len(self.shapes))
        return table

    @cached_property
    def _tables(self) -> tuple[NDArray, NDArray, NDArray]:
        cells = np.zeros((len(self.kinds), 3, 4), np.int64)
        weights = np.zeros((len(self.kinds), 3), np.float32)
        for i, kind in enumerate(self.kinds):
            cells[i, : len(kind.rects)] = kind.rects
            weights[i, : len(kind.weights)] = kind.weights
        return cells, weights, np.array([kind.tilted for kind in self.kinds])


def _places(offsets: NDArray, tilted: NDArray) -> NDArray:
    # Along the axes of a tilted rectangle, right is (1, 1) and down is (-1, 1).
    along, across = offsets[..., 0], offsets[..., 1]
    turned = np.stack([along - across, along + across], axis=-1)
    return np.where(tilted[:, None, None], turned, offsets)
