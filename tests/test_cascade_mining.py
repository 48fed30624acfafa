"""Negatives: what is found passes again, once each, outside the boxes, whatever the number of threads."""

from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest

from laserimg.cascade.features import Pool
from laserimg.cascade.mining import Miner, detector_of
from laserimg.cascade.model import Cascade, Stage, Tree
from laserimg.cascade.pyramid import tiles, windows_of
from laserimg.cascade.stage import StageGoal
from laserimg.cascade.writer import cascade_xml
from laserimg.samples.backgrounds import Backgrounds
from laserimg.samples.labelled import LabelledImage

WINDOW = (14, 12)


def edges(threshold):
    """A cascade that accepts windows whose right half is brighter than the left by some contrast."""
    pool = Pool("basic", *WINDOW)
    number = pool.numbers(np.array([[0, 1, 1, 6, 10]]))
    no_subset, child = np.zeros((1, 8), np.int32), np.array([[0, -1]])
    tree = Tree(number, np.array([threshold], np.float32), no_subset, child, np.array([-1, 1], np.float32))
    return cascade_xml(Cascade(pool, (Stage((tree,), np.float32(0.5)),)), StageGoal())


@pytest.fixture
def photos(tmp_path):
    def make(count, boxes=((),), size=(90, 110)):
        rng = np.random.default_rng(5)
        files = []
        for number in range(count):
            small = rng.integers(0, 256, (9, 11)).astype(np.uint8)
            path = tmp_path / f"{number}.png"
            cv2.imwrite(str(path), cv2.resize(small, size[::-1], interpolation=cv2.INTER_CUBIC))
            marked = np.array(boxes[number % len(boxes)], float).reshape(-1, 4)
            files.append(LabelledImage(path, marked))
        return Backgrounds(files)

    return make


def mine(backgrounds, wanted=60, threshold=0.3, seed=1, expected=0.05, **options):
    miner = Miner(backgrounds, WINDOW, seed, **options)
    return miner.mine(edges(threshold), 1, wanted, expected)


def test_what_is_found_passes_again(photos):
    mined = mine(photos(8))
    assert mined.windows.shape == (60, 12, 14) and not mined.exhausted
    detector = detector_of(edges(0.3))
    assert all(len(detector.detectMultiScale(w, 1.1, 0, 0, WINDOW, WINDOW)) for w in mined.windows)


def test_each_window_is_found_once(photos):
    mined = mine(photos(3), wanted=10**6)
    assert mined.exhausted and len(mined.windows) > 200
    assert len(np.unique(mined.windows.reshape(len(mined.windows), -1), axis=0)) == len(mined.windows)
    again = Miner(photos(3), WINDOW, 1).mine(edges(0.3), 1, 10**6, 0.05, known=mined.windows[::2])
    assert {w.tobytes() for w in again.windows} == {w.tobytes() for w in mined.windows[1::2]}


def test_threads_do_not_change_what_is_found(photos):
    alone = mine(photos(12), wanted=50)
    for threads in (1, 3):
        with ThreadPoolExecutor(threads) as jobs:
            together = mine(photos(12), wanted=50, jobs=jobs)
        assert (together.windows == alone.windows).all()
        assert together.rate == alone.rate


def test_seeds_look_elsewhere(photos):
    first, second = mine(photos(12), seed=1), mine(photos(12), seed=2)
    assert (first.windows != second.windows).any()


def test_all_windows_of_a_pass_are_those_of_the_detector(photos):
    backgrounds = photos(1)
    image, xml = backgrounds.image(0), edges(0.3)
    detector = detector_of(xml)
    found = 0
    for tile in tiles(image, WINDOW, 1.2, 0, np.inf, 8, np.random.default_rng(0)):
        found += len(detector.detectMultiScale(tile.pixels, 2.0, 0, 0, WINDOW, WINDOW))
    # From half the size on OpenCV looks at each row and column; here it is given levels above that alone.
    levels = list(tiles(image, WINDOW, 1.2, 0, np.inf, 8, np.random.default_rng(0)))
    assert sum(tile.windows for tile in levels) == windows_of((110, 90), WINDOW, 1.2)
    above = sum(
        len(detector.detectMultiScale(tile.pixels, 2.0, 0, 0, WINDOW, WINDOW))
        for tile in levels
        if tile.scale < 2
    )
    whole = detector.detectMultiScale(image, 1.2, 0, 0, WINDOW, (27, 23))
    assert above == len(whole) > 0 and found > above


def test_passes_look_at_different_windows(photos):
    image = photos(1).image(0)
    seen = set()
    for turn in range(4):
        for tile in tiles(image, WINDOW, 1.2, turn, np.inf, 8, np.random.default_rng(0)):
            corners = tile.grid(WINDOW) + np.array([tile.x, tile.y])
            keys = {(round(tile.scale, 6), *corner) for corner in corners.tolist()}
            assert len(keys) == tile.windows and not keys & seen
            seen |= keys


def test_parts_are_spread_over_the_pyramid(photos):
    image = photos(1).image(0)
    rng = np.random.default_rng(0)
    visits = [list(tiles(image, WINDOW, 1.2, 0, 60, 6, rng)) for _ in range(300)]
    assert 30 < np.mean([sum(tile.windows for tile in visit) for visit in visits]) < 160
    share = np.mean([tile.scale == 1 for visit in visits for tile in visit])
    expected = windows_of((110, 90), WINDOW, 100.0) / windows_of((110, 90), WINDOW, 1.2)
    assert share == pytest.approx(expected, abs=0.1)


def test_negatives_keep_outside_the_boxes(photos):
    box = (30, 20, 50, 40)
    everything, outside = photos(1), photos(1, boxes=[(box,)])
    all_found, found = mine(everything, 10**6), mine(outside, 10**6)
    assert 0 < len(found.windows) < len(all_found.windows)
    image = outside.image(0).copy()
    image[20:60, 30:80] = 0
    for window in found.windows[:20]:
        full_size = cv2.matchTemplate(image, window, cv2.TM_SQDIFF).min()
        assert full_size == 0 or not (everything.image(0)[20:60, 30:80] == 0).all()


def test_flat_windows_are_left_out_at_first(tmp_path):
    image = np.full((60, 60), 128, np.uint8)
    image[:, 30:] = np.random.default_rng(0).integers(0, 256, (60, 30))
    cv2.imwrite(str(tmp_path / "half.png"), image)
    backgrounds = Backgrounds([LabelledImage(tmp_path / "half.png")])
    mined = Miner(backgrounds, WINDOW, 0, scale_step=8.0).mine(None, 0, 10**6, 1.0)
    assert len(mined.windows) > 100
    assert min(window[1:-1, 1:-1].std() for window in mined.windows) > 10


def test_a_target_stops_the_search(photos):
    backgrounds = photos(130)
    miner = Miner(backgrounds, WINDOW, 0)
    mined = miner.mine(edges(0.3), 1, 10**6, 0.05, target=0.9)
    assert mined.rate.high <= 0.9
    assert mined.rate.windows < 130 * windows_of((110, 90), WINDOW, 1.2)


def test_images_that_cannot_be_used_are_passed_over(tmp_path, photos):
    (tmp_path / "text.png").write_text("not an image")
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((5, 5), np.uint8))
    names = ["text.png", "small.png", "missing.png"]
    wrong = Backgrounds([LabelledImage(tmp_path / name) for name in names])
    mined = mine(wrong)
    assert mined.exhausted and len(mined.windows) == 0 and mined.rate.windows == 0
    mixed = Backgrounds([*wrong.files, *photos(6).files])
    assert len(mine(mixed, 20).windows) == 20


def test_turned_copies_hold_the_same_things_elsewhere(photos):
    turned = Backgrounds(photos(1, boxes=[((30, 20, 50, 40),)]).files, turned=True)
    assert len(turned) == 8
    image, (box,) = turned.image(0), turned.boxes(0)
    x, y, w, h = (int(value) for value in box)
    marked = image[y : y + h, x : x + w]
    seen = []
    for copy in range(8):
        x, y, w, h = (int(value) for value in turned.boxes(copy)[0])
        part = turned.image(copy)[y : y + h, x : x + w]
        straight = part[:, ::-1] if copy >= 4 else part
        assert (np.rot90(straight, -(copy % 4)) == marked).all()
        seen.append(turned.image(copy).tobytes())
    assert len(set(seen)) == 8


def test_memory_for_images_is_kept_to(photos):
    backgrounds = photos(4)
    small = Backgrounds(backgrounds.files, memory=2 * 90 * 110)
    images = [small.image(number) for number in (0, 1, 2, 3, 0, 2)]
    assert small.image(0) is images[0] and small.image(1) is images[1]
    assert small.image(2) is not images[2] and (small.image(2) == images[2]).all()
