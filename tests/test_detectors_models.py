"""Cascades and HOG models as classifiers of windows, beside a loop over all windows."""

import cv2
import numpy as np
import pytest

from window_models import (
    HOG,
    blob_model,
    cascade_model,
    cascade_xml,
    classifier_of,
    haar,
    hog_model,
)

EDGE, STEP = haar("2 2 8 6 -1", "2 2 4 6 2"), haar("0 0 12 10 -1", "0 0 12 5 2")
FIRST = (0.2, [("0 -1 0 0.02", "-0.4 0.6"), ("0 -1 1 -0.1", "0.3 -0.1")])
SECOND = (-0.1, [("0 -1 1 0.03", "-0.7 0.5")])
LBP_MASK = " ".join(["-1431655766"] * 8)


def noise(seed=0, shape=(41, 57)):
    rng = np.random.default_rng(seed)
    coarse = cv2.resize(rng.integers(0, 256, (7, 9), np.uint8), shape[::-1])
    return cv2.addWeighted(coarse, 0.7, rng.integers(0, 256, shape, np.uint8), 0.3, 0)


def alone(classifier, crop):
    """What a cascade says of one window: its sum if it passes, else None."""
    size = crop.shape[::-1]
    _, _, sums = classifier.detectMultiScale3(
        crop, scaleFactor=2, minNeighbors=0, minSize=size, maxSize=size, outputRejectLevels=True
    )
    return float(np.ravel(sums)[0]) if len(sums) else None


def one_by_one(stages, features, kind, image, window=(12, 10)):
    """Every window classified alone; after one that fails the first stage the next is left out."""
    first, whole = (classifier_of(cascade_xml(some, features, window, kind)) for some in (stages[:1], stages))
    found = {}
    for y in range(image.shape[0] - window[1] + 1):
        x = 0
        while x <= image.shape[1] - window[0]:
            crop = np.ascontiguousarray(image[y : y + window[1], x : x + window[0]])
            total = alone(whole, crop)
            if total is not None:
                found[x, y] = total - stages[-1][0]
            x += 1 if alone(first, crop) is not None else 2
    return found


@pytest.mark.parametrize(
    ("kind", "stages", "features"),
    [
        ("HAAR", [FIRST], [EDGE, STEP]),
        ("HAAR", [FIRST, SECOND], [EDGE, STEP]),
        ("LBP", [(0.1, [(f"0 -1 0 {LBP_MASK}", "-0.4 0.6")])], ["<rect>1 1 3 2</rect>"]),
    ],
)
def test_a_cascade_finds_the_windows_that_pass_alone(kind, stages, features):
    image = noise()
    model = cascade_model(cascade_xml(stages, features, (12, 10), kind))
    hits = model.hits(image)
    found = dict(zip(map(tuple, hits.corners.astype(int).tolist()), hits.margins, strict=True))
    expected = one_by_one(stages, features, kind, image)
    assert 20 < len(expected) < 1400
    assert {x % 2 for x, _ in expected} == {y % 2 for _, y in expected} == {0, 1}
    assert found.keys() == expected.keys()
    np.testing.assert_allclose([found[key] for key in expected], list(expected.values()), atol=1e-5)
    assert (hits.margins >= 0).all()


def test_the_blob_cascade_fires_on_its_blob_and_on_nothing_else():
    image = np.full((60, 70), 40, np.uint8)
    model = blob_model(likeness=0.97)
    assert len(model.hits(image).corners) == 0
    image[20:32, 31:43] = 200
    assert model.hits(image).corners.tolist() == [[25, 14]]
    assert len(model.hits(255 - image).corners) == 0
    assert blob_model(bright=False, likeness=0.97).hits(255 - image).corners.tolist() == [[25, 14]]


@pytest.mark.parametrize("window", [(8, 8), (3, 5), (24, 6)])
def test_only_windows_of_the_own_size_are_found_however_small(window):
    """1.1 times 4 pixels are 4 pixels: OpenCV would search such levels twice."""
    features = [haar(f"0 0 {window[0]} {window[1]} 1")]
    always = cascade_model(cascade_xml([(-1, [("0 -1 0 0", "1 1")])], features, window))
    image = noise(shape=(window[1] + 4, window[0] + 6))
    hits = always.hits(image)
    assert len(hits.corners) == len({tuple(corner) for corner in hits.corners.tolist()})
    assert hits.corners.max(axis=0).tolist() == [6, 4]


@pytest.mark.parametrize("shape", [(23, 24), (24, 23), (1, 1), (1, 400)])
def test_an_image_smaller_than_the_window_has_no_hits(shape, tmp_path):
    for model in (blob_model(), hog_model(tmp_path)):
        assert model.hits(np.zeros(shape, np.uint8)).corners.shape == (0, 2)


def test_an_image_of_the_windows_size_has_one_window():
    image = np.full((24, 24), 40, np.uint8)
    image[6:18, 6:18] = 200
    assert blob_model().hits(image).corners.tolist() == [[0, 0]]


def test_a_hog_model_finds_the_windows_on_the_right_side_of_the_plane(tmp_path):
    model = hog_model(tmp_path)
    rng = np.random.default_rng(1)
    image = cv2.GaussianBlur(rng.integers(0, 256, (70, 90), np.uint8), (0, 0), 4)
    image = cv2.normalize(image, None, 0, 255, cv2.NORM_MINMAX)
    cv2.circle(image, (40, 35), 10, 10, -1)
    places = [(x, y) for y in range(0, 70 - 32 + 1, 2) for x in range(0, 90 - 32 + 1, 2)]
    vectors = model.descriptor.compute(image, winStride=(2, 2), locations=places).reshape(len(places), -1)
    weights = np.load(tmp_path / "disc.npz")
    margins = vectors @ weights["weights"] + weights["bias"]
    hits = model.hits(image)
    assert 0 < len(hits.corners) < len(places) / 2
    inside = [place for place, margin in zip(places, margins, strict=True) if margin >= 0]
    assert sorted(map(tuple, hits.corners.astype(int).tolist())) == sorted(inside)
    best = hits.corners[hits.margins.argmax()]
    np.testing.assert_allclose(best, [40 - 15.5, 35 - 15.5], atol=2)
    assert hits.margins.max() == pytest.approx(margins.max(), abs=1e-4)


@pytest.mark.parametrize(
    ("stride", "window", "step"),
    [
        ((8, 8), (64, 128), (4, 8)),
        ((4, 4), (20, 20), (2, 2)),
        ((5, 5), (20, 40), (1, 1)),
        ((6, 4), (36, 64), (3, 4)),
    ],
)
def test_a_hog_window_steps_by_at_most_a_tenth_of_itself(stride, window, step):
    from laserimg.detectors.hog import _step

    block = tuple(2 * side for side in stride)
    arguments = HOG | {"winSize": window, "blockSize": block, "blockStride": stride, "cellSize": stride}
    assert _step(cv2.HOGDescriptor(*arguments.values())) == step
