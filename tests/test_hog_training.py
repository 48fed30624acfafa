"""HOG training: the SVM against scikit-learn's, samples as the detector sees them, and whole runs."""

import json
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.svm import LinearSVC

from command import laserimg
from conftest import DATA
from laserimg.boxes import iou
from laserimg.detectors.hog import load_hog
from laserimg.detectors.shipped import load_model
from laserimg.errors import ConfigError, ModelError
from laserimg.formats.card import Card, read_card
from laserimg.hog_training import folder as folder_module
from laserimg.hog_training.folder import HogRun, HogSamples, train_into_folder
from laserimg.hog_training.frames import describe, framed
from laserimg.hog_training.mining import HogMiner
from laserimg.hog_training.svm import Plane, fit_svm
from laserimg.hog_training.training import HogPlan, train_hog
from laserimg.hog_training.window import HogWindow
from laserimg.samples.backgrounds import Backgrounds
from laserimg.samples.labelled import LabelledImage
from laserimg.samples.vec import write_vec

SIDE = 24
WINDOW = HogWindow((SIDE, SIDE), cell=(6, 6), block=(12, 12), stride=(6, 6))
OPTIONS = ["--window", "24x24", "--cell", "6x6", "--block", "12x12", "--stride", "6x6"]


def draw_cross(image, x, y, rng):
    """A bright cross of about a window, its middle near that of the window at x, y."""
    cx, cy = (int(at + SIDE // 2 + rng.integers(-1, 2)) for at in (x, y))
    arm, thick, level = int(rng.integers(8, 10)), int(rng.integers(3, 6)), int(rng.integers(190, 240))
    cv2.line(image, (cx - arm, cy), (cx + arm, cy), level, thick)
    cv2.line(image, (cx, cy - arm), (cx, cy + arm), level, thick)


def clutter(rng, size=(150, 190)):
    """Blobs, bars and corners of all sizes on a ground that changes slowly."""
    ground = rng.integers(40, 120, (4, 5)).astype(np.uint8)
    image = cv2.resize(ground, size[::-1], interpolation=cv2.INTER_CUBIC)
    for _ in range(12):
        middle, axes = rng.integers(0, size[::-1], 2).tolist(), rng.integers(3, 16, 2).tolist()
        cv2.ellipse(image, middle, axes, float(rng.uniform(0, 180)), 0, 360, int(rng.integers(60, 250)), -1)
        x, y = rng.integers(0, size[::-1], 2).tolist()
        right, down = rng.integers(-20, 21, 2).tolist()
        thick, level = int(rng.integers(3, 6)), int(rng.integers(150, 250))
        cv2.line(image, (x, y), (x + right, y), level, thick)
        cv2.line(image, (x, y), (x, y + down), level, thick)
    return noisy(image, rng)


def noisy(image, rng):
    return (image + rng.normal(0, 5, image.shape)).clip(0, 255).astype(np.uint8)


def crosses(count, seed):
    rng = np.random.default_rng(seed)
    windows = []
    for _ in range(count):
        image = np.full((SIDE, SIDE), int(rng.integers(40, 110)), np.uint8)
        draw_cross(image, 0, 0, rng)
        windows.append(noisy(image, rng))
    return np.array(windows)


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photos")
    rng = np.random.default_rng(3)
    for number in range(10):
        cv2.imwrite(str(folder / f"{number}.png"), clutter(rng))
    return folder


@pytest.fixture(scope="module")
def images(photos):
    return tuple(LabelledImage(path, source=str(path)) for path in sorted(photos.iterdir()))


def plan(**more):
    return HogPlan(WINDOW, **{"rounds": 2, "negatives": 20, "seed": 5, **more})


def miner(images, jobs=None):
    return HogMiner(Backgrounds(images), WINDOW.window, WINDOW.stride, 5, jobs=jobs)


@pytest.fixture(scope="module")
def trained(images):
    return train_hog(plan(), crosses(100, 1), miner(images))


def objective(plane, values, positive, c):
    slack = np.maximum(1 - np.where(positive, 1, -1) * (values @ plane.weights + plane.bias), 0)
    return plane.weights @ plane.weights / 2 + c * (slack**2).sum()


@given(st.integers(0, 10**6), st.sampled_from([0.01, 1.0, 30.0]), st.integers(2, 60), st.integers(1, 40))
@settings(max_examples=40, deadline=None)
def test_no_other_plane_is_better(seed, c, count, dimensions):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(count, dimensions)).astype(np.float32)
    positive = rng.random(count) < 0.4
    plane = fit_svm(values, positive, c)
    least = objective(plane, values, positive, c)
    without = objective(
        Plane(np.zeros(dimensions), 0.0), values, positive, c
    )  # what the solver's end is relative to
    for scale in (1e-3, 1e-2, 1e-1):
        move = rng.normal(size=dimensions + 1) * scale
        other = Plane(plane.weights + move[:-1], plane.bias + move[-1])
        assert objective(other, values, positive, c) >= least * (1 - 1e-4) - 1e-6 * without


@pytest.mark.parametrize("c", [0.01, 0.1, 1.0])
def test_the_plane_is_that_of_scikit_learn(c):
    rng = np.random.default_rng(0)
    values = np.abs(rng.normal(size=(400, 120))).astype(np.float32)
    positive = values[:, :10].sum(axis=1) + rng.normal(0, 1, 400) > 8.5
    plane = fit_svm(values, positive, c)
    # A large scaling leaves the bias of LinearSVC almost free, as ours is.
    peer = LinearSVC(C=c, dual=False, tol=1e-8, max_iter=10000, intercept_scaling=100).fit(values, positive)
    np.testing.assert_allclose(plane.weights, peer.coef_[0], atol=2e-3 * np.abs(peer.coef_).max())
    assert plane.bias == pytest.approx(peer.intercept_[0], rel=1e-2)
    assert objective(plane, values, positive, c) <= objective(
        Plane(peer.coef_[0], peer.intercept_[0]), values, positive, c
    ) * (1 + 1e-5)


def test_a_start_does_not_change_the_plane():
    rng = np.random.default_rng(1)
    values = rng.normal(size=(300, 50)).astype(np.float32)
    positive = rng.random(300) < 0.5
    cold = fit_svm(values, positive, 0.1)
    warm = fit_svm(values, positive, 0.1, Plane(cold.weights + 0.01, cold.bias - 0.1))
    np.testing.assert_allclose(warm.weights, cold.weights, atol=1e-3 * np.abs(cold.weights).max())


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"cell": (7, 7)}, "a block of 12x12 is not made of cells of 7x7"),
        ({"stride": (5, 6)}, "do not end with a window of 24x24"),
        ({"block": (36, 36)}, "do not end with a window"),
        ({"bins": 0}, "bins must be 1 to 180"),
        ({"window": (0, 24)}, "window must be 1 to 1024 pixels, got 0x24"),
    ],
)
def test_windows_that_opencv_cannot_run_are_refused(wrong, message):
    sizes = {"window": (24, 24), "cell": (6, 6), "block": (12, 12), "stride": (6, 6)}
    with pytest.raises(ConfigError, match=message):
        HogWindow(**{**sizes, **wrong})


def test_a_frame_carries_on_a_ramp():
    y, x = np.mgrid[:30, :30]
    ramp = (20 + 3 * x + 2 * y).astype(np.uint8)
    assert (framed(ramp[None, 1:-1, 1:-1])[0] == ramp).all()
    assert framed(np.full((1, 4, 4), 255, np.uint8)).max() == 255


def test_windows_are_described_as_in_their_image():
    image = clutter(np.random.default_rng(8))
    descriptor = WINDOW.descriptor()
    places = [(13, 9), (40, 77), (100, 31)]
    frames = np.array([image[y - 1 : y + SIDE + 1, x - 1 : x + SIDE + 1] for x, y in places])
    within = np.reshape(descriptor.compute(image, locations=places), (len(places), -1))
    np.testing.assert_array_equal(describe(descriptor, frames), within)
    crops = np.array(
        [descriptor.compute(np.ascontiguousarray(frame[1:-1, 1:-1])).ravel() for frame in frames]
    )
    assert np.abs(crops - within).max() > 0.05


def test_margins_are_those_of_the_detector(trained):
    image = clutter(np.random.default_rng(8))
    corners, margins = trained.descriptor().detect(image, hitThreshold=-100, winStride=(6, 6), padding=(0, 0))
    inside = [
        (i, x, y) for i, (x, y) in enumerate(np.reshape(corners, (-1, 2))) if x and y and x < 160 and y < 120
    ]
    frames = np.array([image[y - 1 : y + SIDE + 1, x - 1 : x + SIDE + 1] for _, x, y in inside])
    ours = trained.plane.margins(describe(WINDOW.descriptor(), frames))
    np.testing.assert_allclose(ours, np.ravel(margins)[[i for i, _, _ in inside]], atol=1e-4)


def test_mined_windows_are_false_alarms_each_once(images):
    first = train_hog(plan(rounds=0, negatives=20), crosses(100, 1), miner(images))
    seen = set()
    found = miner(images).mine(first.descriptor(), 1, 400, 1e-3, seen)
    assert len(found.frames) > 30
    margins = first.plane.margins(describe(WINDOW.descriptor(), found.frames))
    assert margins.min() >= -1e-4
    assert len(np.unique(found.frames[:, 1:-1, 1:-1].reshape(len(found.frames), -1), axis=0)) == len(
        found.frames
    )
    again = miner(images).mine(first.descriptor(), 1, 400, 1e-3, seen)
    assert len(again.frames) == 0 and again.rate.accepted > 0


def test_an_image_gives_no_more_than_its_share(images):
    first = train_hog(plan(rounds=0, negatives=20), crosses(100, 1), miner(images))
    told = []
    miner(images).mine(first.descriptor(), 1, 5, 1e-3, set(), lambda images, found: told.append(found))
    assert np.diff([0, *told]).max() <= 4


def test_windows_that_touch_a_box_are_not_taken(photos, images):
    """Everything but one column of the image is boxed: only windows inside that column are left."""
    free = LabelledImage(images[0].path, np.array([[0, 0, 120.0, 150]]), np.array([[165, 0, 25.0, 150]]))
    found = HogMiner(Backgrounds([free]), WINDOW.window, (1, 1), 0).mine(None, 0, 300, 1e-9, set())
    image = cv2.imread(str(free.path), 0)
    # At the image's own scale each window is found back, and its corner lies in the free column.
    places = [cv2.minMaxLoc(cv2.matchTemplate(image, frame, cv2.TM_SQDIFF)) for frame in found.frames]
    own = [(x + 1, y + 1) for least, _, (x, y), _ in places if least == 0]
    assert len(own) > 50
    assert all(120 <= x <= 165 - SIDE for x, _ in own)
    boxed = LabelledImage(images[0].path, np.array([[0, 0, 190.0, 150]]))
    nothing = HogMiner(Backgrounds([boxed]), WINDOW.window, (1, 1), 0).mine(None, 0, 300, 1e-9, set())
    assert len(nothing.frames) == 0
    with pytest.raises(ConfigError, match="no negatives"):
        train_hog(plan(), crosses(20, 1), miner([boxed]))


def test_rounds_lower_the_false_alarms(trained):
    rates = [record.before.value for record in trained.rounds]
    assert rates[0] == 1 and rates[1] < 0.1 and rates[2] < rates[1]
    assert [record.negatives for record in trained.rounds] == np.cumsum(
        [record.added for record in trained.rounds]
    ).tolist()


def test_crosses_are_told_from_clutter(trained):
    fresh = trained.plane.margins(describe(WINDOW.descriptor(), framed(crosses(200, 77))))
    assert (fresh >= 0).mean() > 0.97
    rng = np.random.default_rng(90)
    alarms = [
        len(trained.descriptor().detect(clutter(rng), winStride=(2, 2), padding=(0, 0))[0]) for _ in range(5)
    ]
    assert sum(alarms) < 5 * 5000 * 1e-3


def test_threads_and_repetition_do_not_change_the_result(images, trained):
    for count in (1, 2, 3):
        with ThreadPoolExecutor(count) as jobs:
            again = train_hog(plan(), crosses(100, 1), miner(images, jobs))
        assert (again.plane.weights == trained.plane.weights).all() and again.plane.bias == trained.plane.bias
    other = train_hog(plan(seed=6), crosses(100, 1), HogMiner(Backgrounds(images), WINDOW.window, (6, 6), 6))
    assert (other.plane.weights != trained.plane.weights).any()


def test_the_command_trains_what_detects(tmp_path, photos):
    write_vec(tmp_path / "crosses.vec", crosses(100, 1))
    write_vec(tmp_path / "aside.vec", crosses(50, 2))
    (tmp_path / "bad").mkdir()
    cv2.imwrite(str(tmp_path / "bad" / "small.png"), np.zeros((20, 90), np.uint8))
    (tmp_path / "bad" / "broken.png").write_text("nothing")
    names = [*sorted(photos.iterdir()), tmp_path / "bad/small.png", tmp_path / "bad/broken.png"]
    (tmp_path / "list.txt").write_text("\n".join(map(str, [*names, "gone.png"])))
    done = laserimg(
        *("train", "hog", "--positives", tmp_path / "crosses.vec", "--negatives", tmp_path / "list.txt"),
        *("--validate", tmp_path / "aside.vec", "--validate-negatives", photos, *OPTIONS),
        *("--num-neg", 20, "--rounds", 2, "--class", "cross", "--image", "range", "--jobs", 2),
        *("--object-size", "0.25x0.36", "--margin", 0.1),
        *("-o", tmp_path / "out"),
    )
    assert done.code == 0, done.err
    assert "list.txt, line 11: 90x20 is smaller than the window" in done.err
    assert "list.txt, line 12: broken.png cannot be read" in done.err
    assert "list.txt, line 13: " in done.err and "gone.png does not exist" in done.err
    assert "hit rate: " in done.out and done.out.rstrip().endswith("hog.npz")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["hog.npz", "hog.toml", "log.jsonl"]
    card = read_card(tmp_path / "out" / "hog.toml")
    assert (card.label, card.kind, card.image, card.window) == ("cross", "hog", "range", (SIDE, SIDE))
    assert card.object_size_m == (0.25, 0.36) and card.margin == 0.1
    assert card.scores["hit_rate"] > 0.95 and card.scores["false_alarms_per_window"] < 1e-3
    assert card.versions["opencv"] == cv2.__version__ and card.trained_on == "100 positives of crosses.vec"
    lines = [json.loads(line) for line in (tmp_path / "out" / "log.jsonl").read_text().splitlines()]
    assert [line["event"] for line in lines] == ["round"] * 3 + ["end"]

    model = load_model(tmp_path / "out" / "hog.npz")
    rng = np.random.default_rng(50)
    found, alarms = 0, 0
    for _ in range(10):
        scene = clutter(rng)
        place = rng.integers(5, [190 - SIDE - 5, 150 - SIDE - 5])
        cv2.rectangle(scene, (place - 3).tolist(), (place + SIDE + 3).tolist(), 80, -1)
        draw_cross(scene, *place, rng)
        hits = model.hits(noisy(scene, rng))
        near = np.abs(hits.corners - place).max(axis=1) <= 5
        found, alarms = found + near.any(), alarms + (~near).sum()
    assert found >= 9 and alarms <= 10


def test_weights_and_arguments_come_back_from_the_file(tmp_path, images):
    run = HogRun(plan(), HogSamples(crosses(60, 1), images), tmp_path, Card("c", "hog", "range", (1, 1), ""))
    trained, _ = train_into_folder(run)
    descriptor = load_hog(run.detector)
    vector = np.append(trained.plane.weights, trained.plane.bias).astype(np.float32)
    np.testing.assert_array_equal(np.ravel(descriptor.svmDetector), vector)
    for name, value in WINDOW.arguments.items():
        own = getattr(descriptor, name)
        assert (tuple(own) if isinstance(value, tuple) else own) == value, name
    with np.load(run.detector, allow_pickle=False) as file:
        assert all(file[name].dtype != object for name in file.files)


def test_a_run_that_ends_between_the_files_leaves_no_wrong_pair(tmp_path, images, monkeypatch):
    run = HogRun(plan(), HogSamples(crosses(60, 1), images), tmp_path, Card("c", "hog", "range", (1, 1), ""))
    train_into_folder(run)
    load_model(run.detector)

    def fail(path, card):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(folder_module, "write_card", fail)
    with pytest.raises(OSError, match="No space"):
        train_into_folder(run)
    with pytest.raises(ModelError, match="no card beside it"):
        load_model(run.detector)


def test_a_killed_run_leaves_both_files_or_none(tmp_path, photos):
    write_vec(tmp_path / "crosses.vec", crosses(100, 1))
    words = ["train", "hog", "--positives", tmp_path / "crosses.vec", "--negatives", photos, *OPTIONS]
    command = [sys.executable, "-c", "from laserimg.cli import main; main()", *map(str, words), "-o"]
    start = time.monotonic()
    subprocess.run([*command, str(tmp_path / "whole")], check=True, capture_output=True)
    whole = time.monotonic() - start
    for number, share in enumerate((0.5, 0.8, 0.95)):
        out = tmp_path / str(number)
        process = subprocess.Popen([*command, str(out)], stdout=subprocess.DEVNULL)
        time.sleep(share * whole)
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert not (out / "hog.toml").exists() or load_model(out / "hog.npz")
        assert not (out / "log.jsonl").exists() or (out / "hog.toml").exists()


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (["--window", "24"], 2, "WIDTHxHEIGHT"),
        (["--cell", "7x7"], 2, "not made of cells"),
        (["--image", "normal"], 2, "none of range"),
        (["--c", "0"], 2, "c must be above 0"),
        (["--object-size", "0.5"], 2, "WIDTHxHEIGHT in metres"),
        (["--validate-negatives", "."], 2, "needs --validate"),
        (["--window", "600x600"], 1, "windows of 576 pixels"),
    ],
)
def test_wrong_options_are_told(tmp_path, photos, options, code, message):
    write_vec(tmp_path / "crosses.vec", crosses(20, 1))
    done = laserimg(
        *("train", "hog", "--positives", tmp_path / "crosses.vec", "--negatives", photos),
        *(*OPTIONS, "-o", tmp_path / "out", *options),
    )
    assert done.code == code and message in " ".join(done.err.split())
    assert not (tmp_path / "out").exists()


def test_images_smaller_than_the_window_end_it(tmp_path):
    write_vec(tmp_path / "crosses.vec", crosses(20, 1))
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((20, 90), np.uint8))
    (tmp_path / "list.txt").write_text("small.png\n")
    done = laserimg(
        *("train", "hog", "--positives", tmp_path / "crosses.vec", "--negatives", tmp_path / "list.txt"),
        *(*OPTIONS, "-o", tmp_path / "out"),
    )
    assert done.code == 1 and "line 1: 90x20 is smaller than the window" in done.err
    assert "no negatives: every image" in done.err and not (tmp_path / "out").exists()


def test_chairs_of_a_real_scan_from_images_to_detections(data, tmp_path):
    """Four chairs, varied: shows the path, not a detector of use."""
    scan, labels = data("office_room/room_scan1.pcd"), data("office_room/room_scan1.coco.json")

    def run(*words):
        done = laserimg(*words)
        assert done.code == 0, done.err

    run("images", scan, "-o", tmp_path / "pictures", "-q")
    scans = ["--images", tmp_path / "pictures", "--image", "normals_view", "--class", "office_chair"]
    varied = ["--count", 120, "--turn", "2,5,2", "--noise", 5]
    run("samples", labels, *scans, "--window", "12x18", *varied, "-o", tmp_path / "chairs.vec")
    samples = ["--positives", tmp_path / "chairs.vec", "--negatives", labels, *scans]
    sizes = ["--window", "12x18", "--cell", "3x3", "--block", "6x6", "--stride", "3x3", "--num-neg", 300]
    run("train", "hog", *samples, *sizes, "-o", tmp_path / "chairs")
    (tmp_path / "rules.toml").write_text('format = 1\n[office_chair]\nfrom = ["hog"]\n')
    detectors = ["--cascades", tmp_path / "chairs", "--rules", tmp_path / "rules.toml"]
    run("detect", scan, *detectors, "-o", tmp_path / "found")
    found = json.loads((tmp_path / "found" / "detections.json").read_text())
    best = sorted(found["annotations"], key=lambda entry: -entry["score"])[:12]
    chairs = [(270, 101, 28, 38), (167, 97, 14, 22), (45, 99, 13, 20), (100, 86, 12, 22)]
    hits = [max(iou([chair], [entry["bbox"] for entry in best])[0]) > 0.7 for chair in chairs]
    assert sum(hits) >= 3 and {entry["source"] for entry in best} == {"hog"}


def test_faces():
    """Real faces on real backgrounds; two rounds over a fifth of the images."""
    folder = DATA.parent / "reference" / "faces"
    if not folder.exists():
        pytest.skip(f"needs real data: {folder}")
    names = (folder / "backgrounds.txt").read_text().split()[:200]
    window = HogWindow((20, 20), (4, 4), (8, 8), (4, 4))
    images = Backgrounds([LabelledImage(folder / name) for name in names])
    with ThreadPoolExecutor(2) as jobs:
        trained = train_hog(
            HogPlan(window, 1, 1500),
            np.load(folder / "pos20_train.npy")[:1000],
            HogMiner(images, (20, 20), (4, 4), 0, jobs=jobs),
        )
        test = [
            LabelledImage(folder / name)
            for name in (folder / "test_backgrounds.txt").read_text().split()[:40]
        ]
        rate = HogMiner(Backgrounds(test), (20, 20), (4, 4), 0, jobs=jobs).rate(trained.descriptor())
    faces = describe(window.descriptor(), framed(np.load(folder / "pos20_test.npy")))
    assert (trained.plane.margins(faces) >= 0).mean() > 0.87
    assert rate.value < 2e-5
