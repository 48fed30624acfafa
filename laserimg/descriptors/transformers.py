"""HOG, HONV and 3DHOG as scikit-learn transformers. Importing this imports scikit-learn.

All take the same array, so that a `FeatureUnion` can join them: (n, h, w, 4), of every pixel the normal
n_x, n_y, n_z (0 for none) and the reflectance (0 outside the object).
"""

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, ClassNamePrefixFeaturesOutMixin, TransformerMixin
from sklearn.utils.validation import check_is_fitted

from laserimg.descriptors.hog import hog
from laserimg.descriptors.hog3d import Votes, hog3d
from laserimg.descriptors.honv import honv
from laserimg.descriptors.layout import Layout
from laserimg.scan import Float32Array

_CHANNELS = 4


def checked_images(X: ArrayLike) -> Float32Array:
    """Return X as (n, h, w, 4) float32.

    Raises
    ------
    ValueError
        If it has another shape, or holds values that are not finite.
    """
    images = np.asarray(X, np.float32)
    if images.ndim != 4 or images.shape[-1] != _CHANNELS or 0 in images.shape[1:3]:
        raise ValueError(f"images must be (n, h, w, {_CHANNELS}): normal and reflectance; got {images.shape}")
    if not np.isfinite(images).all():
        raise ValueError("images hold values that are not finite")
    return images


class _Transformer(ClassNamePrefixFeaturesOutMixin, TransformerMixin, BaseEstimator):
    """What the transformers share: nothing is learnt, only checked."""

    layout: Layout | None

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Check the images; nothing is learnt."""
        checked_images(X)
        self._n_features_out = self._length(self.layout or Layout())
        return self

    def transform(self, X: ArrayLike) -> Float32Array:
        """Return the descriptors (n, d) of images (n, h, w, 4)."""
        check_is_fitted(self, "_n_features_out")
        return self._described(checked_images(X), self.layout or Layout())

    def _length(self, layout: Layout) -> int:
        raise NotImplementedError

    def _described(self, images: Float32Array, layout: Layout) -> Float32Array:
        raise NotImplementedError


class Hog(_Transformer):
    """`laserimg.descriptors.hog` of the reflectance.

    Parameters
    ----------
    layout : Layout, optional

    Examples
    --------
    >>> Hog().fit_transform(np.ones((2, 64, 64, 4))).shape
    (2, 3528)
    """

    def __init__(self, layout: Layout | None = None) -> None:
        self.layout = layout

    def _length(self, layout: Layout) -> int:
        return layout.hog_length

    def _described(self, images: Float32Array, layout: Layout) -> Float32Array:
        return hog(_reflectance(images), layout=layout)


class Honv(_Transformer):
    """`laserimg.descriptors.honv` of the normals.

    Parameters
    ----------
    layout : Layout, optional
    """

    def __init__(self, layout: Layout | None = None) -> None:
        self.layout = layout

    def _length(self, layout: Layout) -> int:
        return layout.honv_length

    def _described(self, images: Float32Array, layout: Layout) -> Float32Array:
        return honv(images[..., :3], layout)


class Hog3d(_Transformer):
    """`laserimg.descriptors.hog3d` of reflectance and normals.

    Parameters
    ----------
    layout : Layout, optional
    votes : "hard" or "interpolated"
    """

    def __init__(self, layout: Layout | None = None, votes: Votes = "hard") -> None:
        self.layout = layout
        self.votes: Votes = votes

    def _length(self, layout: Layout) -> int:
        return layout.hog3d_length

    def _described(self, images: Float32Array, layout: Layout) -> Float32Array:
        return hog3d(_reflectance(images), images[..., :3], layout, self.votes)


def _reflectance(images: Float32Array) -> NDArray[np.float32]:
    return np.ascontiguousarray(images[..., 3])
