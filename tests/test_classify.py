"""Classifying objects: views, recipes, the machine, leave-one-out, tables and models."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.utils.estimator_checks import parametrize_with_checks

from analytic import boxes_and_floor, ray_grid
from laserimg.classify import (
    ObjectCloud,
    ObjectModel,
    Recipe,
    class_table,
    crop_of_scan,
    describe_cloud,
    describe_images,
    load_model,
    save_model,
    views_of_cloud,
)
from laserimg.classify.model import verdicts
from laserimg.classify.picture import confusion_picture
from laserimg.classify.recipe import size_numbers
from laserimg.classify.scores import wilson
from laserimg.classify.sources import object_in_box
from laserimg.classify.svm import LinearClassifier
from laserimg.classify.training import train
from laserimg.classify.validation import leave_one_out, predicted, repeated_folds
from laserimg.errors import ConfigError, ModelError, ScanError
from laserimg.scan import Scan


def ball(seed, radius=1.0):
    points = np.random.default_rng(seed).normal(size=(1500, 3))
    return radius * points / np.linalg.norm(points, axis=1, keepdims=True)


def block(seed, size=(2, 1, 1)):
    """Points on the faces of a box."""
    random = np.random.default_rng(seed)
    points = random.uniform(-0.5, 0.5, (1500, 3))
    face = random.integers(0, 3, 1500)
    points[np.arange(1500), face] = random.choice([-0.5, 0.5], 1500)
    return points * size


def rod(seed, length=4.0):
    random = np.random.default_rng(seed)
    angle = random.uniform(0, 2 * np.pi, 800)
    return np.stack([0.08 * np.cos(angle), 0.08 * np.sin(angle), random.uniform(0, length, 800)], axis=-1)


def objects(count=8):
    """Balls, blocks and rods of several sizes, with a stripe of reflectance, turned about z."""
    clouds, labels = [], []
    for index in range(count):
        scale = 0.5 + 0.25 * index
        turn = np.array([[np.cos(index), -np.sin(index), 0], [np.sin(index), np.cos(index), 0], [0, 0, 1]])
        for label, shape in (("ball", ball), ("block", block), ("rod", rod)):
            points = shape(index) * scale
            stripe = (points[:, 2] % 0.4 < 0.2) * 100.0 + 20
            clouds.append(ObjectCloud(points @ turn.T + [50, -20, 3], stripe))
            labels.append(label)
    return clouds, np.array(labels)


@pytest.fixture(scope="module")
def described():
    clouds, labels = objects()
    recipe = Recipe("3dhog+hog", views=2)
    return np.stack([describe_cloud(cloud, recipe) for cloud in clouds]), labels, recipe


# --- clouds and views


def test_a_stray_point_changes_nothing():
    clean = ObjectCloud(block(0))
    stray = ObjectCloud(np.concatenate([block(0), [[9, 9, 9]]]))
    recipe = Recipe("honv", size=True)
    assert_array_equal(describe_cloud(clean, recipe), describe_cloud(stray, recipe))


def test_points_that_are_not_finite_are_left_out():
    cloud = ObjectCloud(np.concatenate([ball(0), [[np.nan, 0, 0]]]), np.full(1501, 5.0))
    assert cloud.points.shape == (1500, 3)
    assert cloud.reflectance is not None and cloud.reflectance.shape == (1500,)


@pytest.mark.parametrize(
    ("points", "values", "message"),
    [
        (np.zeros((20, 2)), None, r"points must be \(n, 3\)"),
        (np.full((20, 3), np.nan), None, "needs at least 10 points, got 0"),
        (np.zeros((20, 3)), np.zeros(19), r"reflectance must be \(20,\), got \(19,\)"),
    ],
)
def test_wrong_clouds(points, values, message):
    with pytest.raises(ScanError, match=message):
        ObjectCloud(points, values)


def test_a_view_shows_the_near_side_at_its_distance():
    images = views_of_cloud(ObjectCloud(np.concatenate([ball(seed) for seed in range(15)])), 3)
    assert images.range.shape == (3, 64, 64)
    seen = images.known
    # 3 radii away from a ball of radius 1; its box is seen under 2 asin(1/3).
    assert 1.95 < images.range[seen].min() < 2.05
    assert np.median(images.range[:, 24:40, 24:40]) < 2.2
    assert 0.7 < seen.mean() < 0.85
    assert_allclose(np.linalg.norm(images.directions, axis=-1), 1, atol=1e-5)


def test_views_turn_and_move_with_the_object():
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    one = views_of_cloud(ObjectCloud(block(2)), 4)
    other = views_of_cloud(ObjectCloud(block(2) @ turn.T + [100, -50, 7]), 4)
    # The axis may come out either way round: then the views are half a turn on.
    differences = [np.abs(one.range - np.roll(other.range, shift, axis=0)).mean() for shift in (0, 2)]
    assert min(differences) < 0.02


def test_upright_in_the_image():
    """A post with a plate on its top: the plate is in the upper rows."""
    post = np.concatenate([rod(0), [0, 0, 3.7] + 0.3 * block(1)])
    images = views_of_cloud(ObjectCloud(post), 2)
    width = images.known.sum(axis=2)
    assert (width[:, 1:8].min(axis=1) > 1.5 * width[:, 20:60].max(axis=1)).all()


def test_points_in_one_place_or_on_one_line_show_no_surface():
    for points in (np.zeros((30, 3)), np.linspace([0, 0, 0], [0, 0, 3], 100)):
        with pytest.raises(ScanError, match="nothing of the object can be described"):
            describe_cloud(ObjectCloud(points), Recipe("honv"))


# --- recipes


@pytest.mark.parametrize(
    ("features", "length"),
    [("honv", 15876), ("honv+hog", 19404), ("3dhog", 15876), ("3dhog+hog", 19404)],
)
def test_lengths_of_the_paper(features, length):
    cloud = objects(1)[0][0]
    vector = describe_cloud(cloud, Recipe(features))
    assert vector.shape == (length,)
    assert np.linalg.norm(vector) == pytest.approx(1, abs=1e-5)
    assert describe_cloud(cloud, Recipe(features, size=True)).shape == (length + 3,)


def test_without_reflectance():
    cloud = ObjectCloud(ball(0))
    assert describe_cloud(cloud, Recipe("honv")).any()
    with pytest.raises(ScanError, match="has no reflectance, which the features 3dhog need"):
        describe_cloud(cloud, Recipe("3dhog"))
    assert describe_cloud(cloud, Recipe("3dhog", appearance="range")).any()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"features": "hog"}, "features must be one of honv, honv.hog, 3dhog, 3dhog.hog, got 'hog'"),
        ({"views": 0}, "views must be a whole number from 1 to 64, got 0"),
        ({"views": 2.5}, "views must be a whole number from 1 to 64, got 2.5"),
        ({"size": "x"}, "size must be true or false"),
        ({"appearance": "colour"}, "appearance must be one of reflectance, range"),
        ({"more": 1}, "not a recipe"),
    ],
)
def test_wrong_recipes(wrong, message):
    with pytest.raises(ConfigError, match=message):
        Recipe.from_dict(wrong)


def test_size_is_in_metres():
    sizes = np.exp(size_numbers(block(3, (4.5, 1.8, 1.5))))
    assert_allclose(sizes, [1.5, 4.5, 1.8], rtol=0.08)


# --- the machine


@parametrize_with_checks([LinearClassifier()])
def test_scikit_learn_accepts_the_estimator(estimator, check):
    check(estimator)


def test_leave_one_out_is_exact(described):
    vectors, labels, _ = described
    labels = labels.copy()
    labels[[1, 5]] = labels[[5, 0]]  # make it hard: wrong labels are support vectors
    fast = leave_one_out(vectors, labels)
    for index in range(len(labels)):
        rest = np.arange(len(labels)) != index
        slow = LinearClassifier().fit(vectors[rest], labels[rest]).decision_function(vectors[index][None])
        assert_allclose(fast[index], slow[0], atol=5e-3)


def test_leave_one_out_and_folds_classify(described):
    vectors, labels, _ = described
    assert (predicted(leave_one_out(vectors, labels), labels) == labels).mean() > 0.9
    runs = repeated_folds(vectors, labels, folds=4, repeats=2)
    assert len(runs) == 2 and not np.array_equal(runs[0], runs[1])
    assert all((predicted(run, labels) == labels).mean() > 0.9 for run in runs)
    assert_array_equal(repeated_folds(vectors, labels, 4, 1)[0], runs[0])


def test_labels_without_meaning_are_not_learnt():
    random = np.random.default_rng(0)
    vectors = random.normal(size=(60, 500)) / np.sqrt(500)
    labels = np.array(["a", "b", "c"])[random.integers(0, 3, 60)]
    assert (predicted(leave_one_out(vectors, labels), labels) == labels).mean() < 0.55


@pytest.mark.parametrize(
    ("labels", "message"),
    [(["a", "a", "a"], "at least 2 classes, got 1"), (["a", "a", "b"], "class b has only 1 object")],
)
def test_too_few_objects(labels, message):
    with pytest.raises(ConfigError, match=message):
        leave_one_out(np.eye(3), np.array(labels))


# --- verdicts and models


def test_confidence_grows_with_the_margin_and_small_margins_are_unknown(described):
    vectors, labels, recipe = described
    model = train(vectors, labels, recipe).model
    sure, mixed = model.classify(np.stack([vectors[0], (vectors[0] + vectors[1]) / 2]))
    assert sure.label == "ball" and sure.confidence > mixed.confidence
    assert 1 / 3 <= mixed.confidence <= sure.confidence <= 1
    assert {verdict.label for verdict in model.classify(vectors, margin=100)} == {"unknown"}
    assert verdicts(np.array([[1.0, 0.4]]), ("a", "b"), margin=0.5)[0].label == "a"


def test_model_round_trip(described, tmp_path):
    vectors, labels, recipe = described
    model = train(vectors, labels, recipe, margin=0.05).model
    save_model(tmp_path / "m.npz", model)
    again = load_model(tmp_path / "m.npz")
    assert (again.labels, again.recipe, again.margin) == (model.labels, recipe, 0.05)
    assert again.classify(vectors) == model.classify(vectors)
    assert_array_equal(again.weights, model.weights)


def test_the_model_is_the_machine(described):
    vectors, labels, recipe = described
    model, machine = train(vectors, labels, recipe).model, LinearClassifier().fit(vectors, labels)
    assert_allclose(model.decide(vectors), machine.decision_function(vectors), atol=1e-5)


def small_model(**changes):
    recipe = Recipe("honv")
    values = {
        "labels": ("a", "b"),
        "weights": np.zeros((2, recipe.length), np.float32),
        "bias": np.zeros(2, np.float32),
        "recipe": recipe,
    }
    return ObjectModel(**{**values, **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bias": np.array([0, np.nan])}, "the weights are not finite"),
        ({"weights": np.zeros((2, 5))}, r"weights must be \(2, 15876\)"),
        ({"labels": ("a", "a")}, "different classes"),
        ({"sharpness": 0.0}, "sharpness must be above 0"),
    ],
)
def test_wrong_models(changes, message):
    with pytest.raises(ModelError, match=message):
        small_model(**changes)


def test_wrong_model_files(tmp_path):
    path = tmp_path / "m.npz"
    with pytest.raises(ModelError, match=r"m\.npz: no such file"):
        load_model(path)
    path.write_bytes(b"not a model")
    with pytest.raises(ModelError, match=r"m\.npz: not an NPZ file"):
        load_model(path)
    np.savez(path, range=np.ones(3))
    with pytest.raises(ModelError, match="needs head, weights and bias"):
        load_model(path)
    save_model(path, small_model())
    arrays = dict(np.load(path))
    arrays["weights"][0, 0] = np.nan
    np.savez(path, **arrays)
    with pytest.raises(ModelError, match=r"m\.npz: the weights are not finite"):
        load_model(path)
    head = bytes(np.load(path)["head"])
    arrays["weights"][0, 0] = 0
    for text, message in (
        (b'{"format": 1}', "its head is malformed"),
        (b"[" * 200_000, "its head is malformed"),
        (head.replace(b'"sharpness": 1.0', b'"sharpness": 1' + b"0" * 400), "its head is malformed"),
        (head.replace(b'"size": false', b'"size": "x"'), "size must be true or false"),
    ):
        assert text != head
        np.savez(path, **(arrays | {"head": np.frombuffer(text, np.uint8)}))
        with pytest.raises(ModelError, match=message):
            load_model(path)


# --- tables


def test_the_table_of_the_paper():
    """3DHOG of paper 1: 481 of 490; Building 102 of 103, detected 105."""
    truth = np.repeat(["Building", "Car"], [103, 104])
    found = np.array(["Building"] * 102 + ["Car"] + ["Building"] * 3 + ["Car"] * 101)
    table = class_table(truth, found)
    plain = table.as_dict()
    assert plain["classes"]["Building"] == {
        "images": 103,
        "detected": 105,
        "correct": 102,
        "precision": pytest.approx(0.9714, abs=1e-4),
        "recall": pytest.approx(0.9903, abs=1e-4),
    }
    assert plain["total"]["images"] == 207 and plain["total"]["correct"] == 203
    assert table.balanced_accuracy == pytest.approx((102 / 103 + 101 / 104) / 2)


def test_unknown_is_neither_detected_nor_correct():
    table = class_table(np.array(["a", "a", "b"]), np.array(["a", "unknown", "b"]))
    assert table.detected.tolist() == [1, 1]
    assert table.recall.tolist() == [0.5, 1]
    assert table.counts[0].tolist() == [1, 0, 1]


def test_wilson_covers():
    """Of shares drawn from 0.95, at least 93 % of the intervals hold 0.95."""
    hits = np.random.default_rng(0).binomial(200, 0.95, 2000)
    bounds = np.array([wilson(int(hit), 200) for hit in hits])
    assert ((bounds[:, 0] <= 0.95) & (bounds[:, 1] >= 0.95)).mean() > 0.93


def test_the_picture_shows_right_in_green_and_wrong_in_red():
    table = class_table(np.array(["a", "a", "b", "b"]), np.array(["a", "b", "b", "b"]))
    picture = confusion_picture(table)
    height, width, _ = picture.shape
    right, wrong = (picture[100, width - 20 - 84 * n - 10].astype(int) for n in (1, 0))
    assert right[1] > right[0] and wrong[0] > wrong[1]
    assert min(height, width) > 84 * 2 and max(height, width) < 300


# --- crops of scans


def room():
    """Two boxes on a floor, one across the seam."""
    grid = ray_grid(np.arange(179.75, -180, -0.5), np.arange(20.0, -30, -0.5), wraps=True)
    return boxes_and_floor(grid, [((-6, -1, -1.5), (-4.5, 1, 0.5)), ((5, -1, -1.5), (6, 0.5, 1))])


def test_object_in_a_box_leaves_ground_and_background_out():
    scan = room()
    mask = object_in_box(scan, (340, 20, 50, 60))
    points = scan.points()[mask]
    assert points[:, 0].min() > 4.9 and points[:, 2].min() > -1.4
    assert 1.3 < np.ptp(points[:, 1]) < 1.6


def test_a_crop_at_the_seam_is_that_of_the_turned_scan():
    scan = room()
    mask = object_in_box(scan, (690, 20, 60, 60))
    turned = Scan(np.roll(scan.range, 200, 1), np.roll(scan.directions, 200, 1), wraps=True)
    one, other = crop_of_scan(scan, mask), crop_of_scan(turned, np.roll(mask, 200, 1))
    assert_allclose(one.range, other.range, atol=1e-6)
    assert one.known.mean() > 0.9
    assert 4.4 < one.range[one.known].min() < 4.6


def test_a_crop_is_described():
    scan = room()
    mask = object_in_box(scan, (340, 20, 50, 60))
    vector = describe_images(crop_of_scan(scan, mask), scan.points()[mask], Recipe("honv", size=True))
    assert vector.shape == (15879,) and np.isfinite(vector).all()


def test_crops_of_one_pixel():
    scan = room()
    mask = np.zeros(scan.shape, bool)
    mask[50, 360] = True
    with pytest.raises(ScanError, match="needs at least 2 returns in a scan, got 1"):
        crop_of_scan(scan, mask)
    with pytest.raises(ScanError, match="no object in the box"):
        object_in_box(scan, (10, 0, 1, 1))


def test_a_stray_point_far_away_is_taken_out_and_not_refused():
    cloud = ObjectCloud(np.concatenate([ball(0), [[5000.0, 0, 0]]]))
    assert len(cloud.without_strays().points) == len(ball(0))
