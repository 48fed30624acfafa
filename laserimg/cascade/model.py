"""A cascade in memory: stages of small trees on features, deciding on windows as OpenCV's detector does."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.features import Pool
from laserimg.cascade.integral import passes_gate
from laserimg.cascade.windows import Windows

# OpenCV lowers every stage threshold by this much on loading.
THRESHOLD_MARGIN = np.float32(1e-5)


@dataclass(frozen=True, eq=False, slots=True)
class Tree:
    """A decision tree on features of a pool; with one node, a stump.

    Attributes
    ----------
    features : (nodes,) int64
        Numbers in the pool.
    thresholds : (nodes,) float32
        Haar: a value below goes left.
    subsets : (nodes, 8) int32
        LBP: a code whose bit is set goes left.
    children : (nodes, 2) int64
        Left and right: the number of a node, or minus that of a leaf (0 is leaf 0; none leads to node 0).
    leaves : (nodes + 1,) float32
    """

    features: NDArray[np.int64]
    thresholds: NDArray[np.float32]
    subsets: NDArray[np.int32]
    children: NDArray[np.int64]
    leaves: NDArray[np.float32]

    def leaf_of(self, values: NDArray) -> NDArray[np.int64]:
        """Return the leaf of every window from the (nodes, windows) values of the tree's features."""
        left = self._goes_left(values)
        place = np.where(left[0], self.children[0, 0], self.children[0, 1])
        while (inner := np.flatnonzero(place > 0)).size:
            node = place[inner]
            place[inner] = np.where(left[node, inner], self.children[node, 0], self.children[node, 1])
        return -place

    def _goes_left(self, values: NDArray) -> NDArray[np.bool_]:
        if values.dtype != np.uint8:
            return values < self.thresholds[:, None]
        words = np.take_along_axis(self.subsets, values >> 5, axis=1)
        return (words >> (values & 31)) & 1 == 1


@dataclass(frozen=True, eq=False, slots=True)
class Stage:
    """Trees whose leaves are added up, and the sum a window needs to pass."""

    trees: tuple[Tree, ...]
    threshold: np.float32

    @property
    def features(self) -> NDArray[np.int64]:
        """Numbers of the features of all nodes of all trees, in order."""
        return np.concatenate([tree.features for tree in self.trees])

    def sums(self, pool: Pool, windows: Windows) -> NDArray[np.float64]:
        """Return the sum of leaves of every window."""
        values = windows.measure(pool[self.features])
        sums = np.zeros(len(windows))
        first = 0
        for tree in self.trees:
            last = first + len(tree.features)
            sums += tree.leaves[tree.leaf_of(values[first:last])]
            first = last
        return sums

    def passed(self, sums: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which sums are enough for OpenCV's detector."""
        return sums >= np.float64(np.float32(self.threshold) - THRESHOLD_MARGIN)


@dataclass(frozen=True, eq=False, slots=True)
class Cascade:
    """Stages that a window must pass one after the other, and the pool their features are numbered in."""

    pool: Pool
    stages: tuple[Stage, ...] = ()

    def __len__(self) -> int:
        return len(self.stages)

    def with_stage(self, stage: Stage) -> "Cascade":
        """Return the cascade with one stage more."""
        return replace(self, stages=(*self.stages, stage))

    def passes(self, pixels: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Return which (n, height, width) windows OpenCV's detector accepts."""
        lbp = self.pool.mode == "lbp"
        accepted = np.ones(len(pixels), bool) if lbp else passes_gate(pixels)
        for stage in self.stages:
            left = np.flatnonzero(accepted)
            windows = Windows.of(pixels[left], self.pool.mode)
            accepted[left] = stage.passed(stage.sums(self.pool, windows))
        return accepted
