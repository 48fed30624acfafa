"""The transformers in scikit-learn's pipelines, unions and clones."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.pipeline import FeatureUnion, make_pipeline

from laserimg.classify.svm import LinearClassifier
from laserimg.descriptors import Layout, hog, hog3d, honv
from laserimg.descriptors.transformers import Hog, Hog3d, Honv


@pytest.fixture(scope="module")
def images():
    random = np.random.default_rng(0)
    normals = random.normal(size=(6, 24, 16, 3))
    normals[..., 2] = -np.abs(normals[..., 2])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.concatenate([normals, random.random((6, 24, 16, 1))], axis=-1).astype(np.float32)


def test_equal_to_the_functions(images):
    normals, values = images[..., :3], images[..., 3]
    assert_array_equal(Hog().fit_transform(images), hog(values))
    assert_array_equal(Honv().fit_transform(images), honv(normals))
    assert_array_equal(Hog3d().fit_transform(images), hog3d(values, normals))
    soft = Hog3d(votes="interpolated").fit_transform(images)
    assert_array_equal(soft, hog3d(values, normals, votes="interpolated"))


def test_union_has_the_dimensions_of_the_paper(images):
    union = FeatureUnion([("honv", Honv()), ("hog", Hog())]).fit(images)
    assert union.transform(images).shape == (6, 19404)
    assert len(union.get_feature_names_out()) == 19404


def test_clone_and_parameters(images):
    layout = Layout(cells=4)
    one = clone(Hog3d(layout, votes="interpolated"))
    assert one.get_params() == {"layout": layout, "votes": "interpolated"}
    assert one.set_params(layout=None).fit(images).transform(images).shape == (6, 15876)


def test_in_a_pipeline(images):
    pipeline = make_pipeline(Honv(Layout(cells=2)), LinearClassifier())
    labels = ["a", "b", "c"] * 2
    assert pipeline.fit(images, labels).predict(images).tolist() == labels


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (np.zeros((2, 8, 8)), r"images must be \(n, h, w, 4\)"),
        (np.zeros((2, 0, 8, 4)), r"got \(2, 0, 8, 4\)"),
        (np.full((1, 8, 8, 4), np.nan), "not finite"),
    ],
)
def test_wrong_images(wrong, message):
    with pytest.raises(ValueError, match=message):
        Hog().fit(wrong)


def test_not_fitted(images):
    with pytest.raises(NotFittedError, match="not fitted yet"):
        Honv().transform(images)
