"""The search: what stands at a known place with a known size is found there with that size."""

from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analytic import ray_grid
from laserimg.boxes import iou
from laserimg.detectors.levels import MAX_ENLARGE, SCALE_STEP, Level, plain_levels
from laserimg.detectors.metric import MIN_FITTING, metric_levels
from laserimg.detectors.parts import MAX_SPREAD, parts_of
from laserimg.detectors.pyramid import Pyramid
from laserimg.detectors.search import Searched, WindowDetector, search
from laserimg.errors import ConfigError
from laserimg.evidence import Evidence
from laserimg.geometry.pitch import angular_pitch
from laserimg.images import make_image
from laserimg.images.stretch import stretch
from laserimg.scan import Scan
from window_models import blob_model, hog_model

EVERYWHERE = np.ones((1, 1), np.bool_)


def evidence_of(scan, **images):
    return Evidence(scan, images, angular_pitch(scan), None, None, ())


def grid_of(shape, pitch_deg=(0.5, 0.5), wraps=False):
    """A grid of equal pitches across and up, around the horizon."""
    across, up = pitch_deg
    azimuth = (shape[1] - 1) / 2 - np.arange(shape[1])
    elevation = (shape[0] - 1) / 2 - np.arange(shape[0])
    return ray_grid(azimuth * across, elevation * up, wraps)


def square(shape, box, ground=40, bright=200):
    """An image with a bright rectangle, across the seam too."""
    x, y, w, h = box
    image = np.full(shape, ground, np.uint8)
    image[y : y + h, np.arange(x, x + w) % shape[1]] = bright
    return image


def around(box, margin=0.5):
    x, y, w, h = box
    return x - margin * w, y - margin * h, (1 + 2 * margin) * w, (1 + 2 * margin) * h


# Box of the bright rectangle: the window is twice as wide and high, 24 pixels when resized.
@pytest.mark.parametrize(
    "box",
    [(60, 50, 12, 12), (61, 47, 7, 7), (61, 47, 6, 9), (35, 41, 31, 31), (50, 30, 17, 60), (32, 42, 67, 20)],
)
@pytest.mark.parametrize("wraps", [False, True])
def test_a_level_puts_its_hits_where_the_object_is(box, wraps):
    """Scaled down, up, and differently across and up."""
    image = square((120, 150), box)
    window = 2.0 * box[2], 2.0 * box[3]
    boxes, _ = search(blob_model(likeness=0.9), image, [Level(window, (150, 120), (0, 0), EVERYWHERE)], wraps)
    assert len(boxes) > 0
    pixel = np.array(window) / 24
    np.testing.assert_allclose(boxes.mean(axis=0), around(box), atol=max(1, pixel.max()))
    # One pixel of the resized image is the least that a window can be wrong by; it may be wrong by no more.
    best = np.abs(boxes - around(box)).max(axis=1).min()
    assert best <= max(0.5, 0.5 * pixel.max())


@pytest.mark.parametrize("x", range(138, 152, 3))
def test_an_object_at_the_seam_is_found_once(x):
    image = square((120, 150), (x, 50, 12, 12))
    level = Level((24.0, 24.0), (150, 120), (0, 0), EVERYWHERE)
    boxes, _ = search(blob_model(likeness=0.8), image, [level], wraps=True)
    assert len({(left % 150, top) for left, top, _, _ in boxes}) == len(boxes) > 0
    assert (iou(boxes, [around((x, 50, 12, 12))], 150) > 0.7).all()
    if x > 140:
        assert len(search(blob_model(likeness=0.8), image, [level], wraps=False)[0]) == 0


def test_views_of_every_size_show_the_same_place():
    """A step in gray lies at the same column and row of the grid in views of all sizes."""
    image = np.zeros((97, 131), np.uint8)
    image[40:, 55:] = 250
    for wraps in (False, True):
        pyramid = Pyramid.of(image, wraps)
        for pixel in ([0.5, 0.5], [1, 1], [1.7, 0.8], [2.6, 2.2], [5, 3], [6.5, 6.5], [1, 8]):
            view = pyramid.view(np.array([21.0, 13]), np.array([97.0, 88]), np.array(pixel, float))
            extent = np.array(view.image.shape[::-1]) * view.pixel
            assert (view.corner <= [21, 13]).all()
            assert (view.corner + extent >= [97, 88]).all()
            np.testing.assert_allclose(view.pixel, pixel, rtol=0.1)
            # Gray is the share of a pixel that is bright: their sum is where the step lies.
            bright = view.image / 250
            step = view.corner + extent - view.pixel * [bright[-1].sum(), bright[:, -1].sum()]
            np.testing.assert_allclose(step, [55, 40], atol=0.05 * max(pixel))


@pytest.mark.parametrize("pitch_deg", [(0.4, 0.4), (0.4, 0.8), (0.3, 0.2), (0.6, 0.2)])
@pytest.mark.parametrize("height", [21, 30, 42])
def test_plain_search_finds_a_square_thing_with_its_size(pitch_deg, height):
    """Square to the eye of the scanner, not in pixels."""
    across, up = pitch_deg
    box = (61, 53, round(height * up / across), height)
    image = square((150, 220), box)
    evidence = evidence_of(grid_of((150, 220), pitch_deg), range=image)
    (candidate,) = WindowDetector(blob_model(), "plain")(evidence)
    assert iou([candidate.box], [box])[0, 0] > 0.8
    assert (candidate.label, candidate.source, candidate.name) == ("thing", "cascade", "by_hand")


def test_plain_search_enlarges_coarse_images_only():
    card = blob_model().card
    for pitch, smallest in ((0.1, 24), (0.2, 24), (0.3, 24 / 1.44), (1.0, 12)):
        evidence = evidence_of(grid_of((61, 70), (pitch, pitch)))
        windows = [level.window for level in plain_levels(evidence, card)]
        assert windows[0] == pytest.approx((smallest, smallest), rel=0.04)
        assert all(b[0] / a[0] == pytest.approx(SCALE_STEP) for a, b in pairwise(windows))
        assert 60 / SCALE_STEP < windows[-1][1] <= 61


def test_plain_search_finds_every_size_once_also_across_the_seam():
    grid = ray_grid(np.arange(180, -180, -1.0) - 0.5, np.arange(40, -40, -1.0), wraps=True)
    for size in range(9, 31, 3):
        for x in (0, 100, 360 - size // 2, 359):
            image = square(grid.shape, (x, 30, size, size))
            (candidate,) = WindowDetector(blob_model(), "plain")(evidence_of(grid, range=image))
            left, _, w, _ = candidate.box
            assert 0 <= left < 360
            assert (left + w > 360) == (x + size > 360 or left > 360 - w)
            assert iou([candidate.box], [(x, 30, size, size)], 360)[0, 0] > 0.8


def ball(elevation_deg, azimuth_deg=0.0, distance_m=2.0, radius_m=0.2, behind_m=6.0, **grid):
    """A ball before a round wall, and the box of its pixels."""
    azimuth = grid.get("azimuth", azimuth_deg + np.arange(30.0, -30.0, -0.3))
    rays = ray_grid(azimuth, elevation_deg + np.arange(20.0, -20.0, -0.3), grid.get("wraps", False))
    tilt, turn = np.radians([elevation_deg, azimuth_deg])
    centre = distance_m * np.array([np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)])
    along = rays.directions.astype(float) @ centre
    inside = along**2 - (centre @ centre - radius_m**2)
    hit = (inside > 0) & (along > 0)
    range_m = np.where(hit, along - np.sqrt(np.maximum(inside, 0)), behind_m)
    middle = int(np.argmax(rays.directions[rays.shape[0] // 2] @ centre))
    turned = np.roll(hit, rays.shape[1] // 2 - middle, axis=1)
    rows, columns = np.flatnonzero(hit.any(axis=1)), np.flatnonzero(turned.any(axis=0))
    left = (columns[0] + middle - rays.shape[1] // 2) % rays.shape[1]
    box = (left, rows[0], columns[-1] - columns[0] + 1, rows[-1] - rows[0] + 1)
    return Scan(range_m.astype(np.float32), rays.directions, wraps=rays.wraps), tuple(map(float, box))


@pytest.mark.parametrize("elevation", [0.0, -45.0, 30.0, -60.0])
def test_a_ball_gets_the_right_box_level_and_far_below(elevation, tmp_path):
    """Far below, the grid widens what is in it: by 1 / cos(elevation)."""
    scan, box = ball(elevation)
    assert box[2] / box[3] == pytest.approx(1 / np.cos(np.radians(elevation)), rel=0.05)
    model = hog_model(tmp_path, object_size_m=(0.4, 0.4))
    candidates = WindowDetector(model)(evidence_of(scan, range=make_image(scan, "range")))
    candidate = max(candidates, key=lambda one: one.score)
    assert iou([candidate.box], [box])[0, 0] > 0.9
    assert candidate.score > 2 * sum(other.score for other in candidates if other is not candidate)


def test_a_cascade_finds_the_ball_in_relative_depth():
    scan, box = ball(-45.0)
    model = blob_model(bright=False, likeness=0.7, image="depth_relative", object_size_m=(0.35, 0.35))
    evidence = evidence_of(scan, depth_relative=make_image(scan, "depth_relative"))
    (candidate,) = WindowDetector(model)(evidence)
    # The square that is most like a disc is smaller than the disc.
    assert iou([candidate.box], [box])[0, 0] > 0.65
    assert candidate.box[2] / candidate.box[3] == pytest.approx(box[2] / box[3], rel=0.1)


@pytest.mark.parametrize("azimuth", [180.0, 178.0, 176.0, 174.0, 186.0, 0.0])
@pytest.mark.parametrize(("scale", "least"), [("metric", 0.85), ("plain", 0.7)])
def test_a_ball_across_the_seam_is_found_once(azimuth, scale, least, tmp_path):
    scan, box = ball(-20.0, azimuth, azimuth=np.arange(180.0, -180.0, -0.5) - 0.25, wraps=True)
    model = hog_model(tmp_path, object_size_m=(0.4, 0.4))
    # The percentiles of a whole turn would leave nothing of so small a thing.
    image = stretch(scan.range, scan.valid, (0.0, 9.0))
    candidates = WindowDetector(model, scale)(evidence_of(scan, range=image))
    found = [one for one in candidates if iou([one.box], [box], 720)[0, 0] > 0.3]
    assert len(found) == 1
    x, _, w, _ = found[0].box
    assert 0 <= x < 720
    assert iou([found[0].box], [box], 720)[0, 0] > least
    if azimuth == 180.0:
        assert x + w > 720


def test_metric_search_passes_by_what_has_another_size(tmp_path):
    """Two balls that look alike, one twice as far away and twice as large."""
    near, near_box = ball(0.0, 15.0, 2.0, 0.2, 9.0, azimuth=np.arange(30.0, -30.0, -0.3))
    far, far_box = ball(0.0, -15.0, 4.0, 0.4, 9.0, azimuth=np.arange(30.0, -30.0, -0.3))
    scan = Scan(np.minimum(near.range, far.range), near.directions)
    evidence = evidence_of(scan, range=make_image(scan, "range"))

    def found(model, scale):
        boxes = [candidate.box for candidate in WindowDetector(model, scale)(evidence)]
        return (iou(boxes, [near_box, far_box]) > 0.7).sum(axis=0).tolist()

    assert found(hog_model(tmp_path), "plain") == [1, 1]
    assert found(hog_model(tmp_path, object_size_m=(0.4, 0.4)), "metric") == [1, 0]
    assert found(hog_model(tmp_path, object_size_m=(0.8, 0.8)), "metric") == [0, 1]


@pytest.mark.parametrize("column", [0, 180, 355])
def test_metric_search_sees_a_thing_whose_middle_is_open(column):
    """A frame, across the seam too: the returns in the middle of its box are those of the wall behind it."""
    rays = ray_grid(np.arange(180, -180, -1.0) - 0.5, np.arange(30, -30, -1.0) - 0.5, wraps=True)
    box = (column, 20, 20, 20)
    frame = square(rays.shape, box) != square(rays.shape, ((column + 2) % 360, 22, 16, 16))
    scan = Scan(np.where(frame, 2.0, 9.0).astype(np.float32), rays.directions, wraps=True)
    side = 2 * 2.0 * np.tan(np.radians(10))
    evidence = evidence_of(scan, range=square(rays.shape, box))
    (candidate,) = WindowDetector(blob_model(object_size_m=(side, side)))(evidence)
    assert iou([candidate.box], [box], 360)[0, 0] > 0.8


def noisy_scan(seed, wraps=False):
    """Blocks at some ranges, some without return, in a grid that turns and tilts."""
    rng, shape = np.random.default_rng(seed), (80, 240 if wraps else 120)
    blocks = rng.choice([0.0, 0.8, 1.5, 3.0, 6.0], size=(5, 8))
    range_m = cv2.resize(blocks, shape[::-1], interpolation=cv2.INTER_NEAREST).astype(np.float32)
    azimuth = np.arange(180.0, -180.0, -1.5) - 0.75 if wraps else np.arange(60.0, -60.0, -1.0)
    grid = ray_grid(azimuth, np.linspace(10, -65, shape[0]), wraps)
    return Scan(range_m, grid.directions, wraps=wraps)


@pytest.mark.parametrize("wraps", [False, True])
def test_metric_levels_are_those_of_the_definition(wraps):
    """Against a loop over windows: the sizes that enough pixels ask for, each window in one level."""
    scan = noisy_scan(0, wraps)
    evidence = evidence_of(scan)
    card = replace(blob_model(object_size_m=(0.3, 0.4)).card, margin=0.1)
    levels = list(metric_levels(evidence, card))
    across, up = (pitch.astype(float) for pitch in evidence.pitch)
    steps = np.rint(np.log(0.4 / np.maximum(scan.range * up, 1e-9)) / np.log(SCALE_STEP))
    height, width = scan.shape

    def share(step, centre, window):
        """Of the pixels of a window, how many have a range that fits."""
        first, last = np.rint(centre - window / 2).astype(int), np.rint(centre + window / 2).astype(int)
        columns, rows = np.arange(first[0], last[0]), np.arange(first[1], last[1])
        columns = columns % width if wraps else columns[(columns >= 0) & (columns < width)]
        kept = np.ix_(rows[(rows >= 0) & (rows < height)], columns)
        return ((np.abs(steps[kept] - step) <= 1) & scan.valid[kept]).sum() / np.prod(last - first)

    smallest = np.array(card.window) / MAX_ENLARGE
    rng, searched, passed_by = np.random.default_rng(0), 0, 0
    for _ in range(4000):
        step, centre = rng.integers(12, 23), rng.uniform([0, 0], [width, height])
        column, row = centre.astype(int)
        thing = SCALE_STEP**step * np.array([0.75 * up[row, column] / across[row, column], 1])
        window = 1.2 * thing
        box = np.concatenate([centre - window / 2, window])[None]
        of_height = [level for level in levels if abs(level.window[1] - window[1]) < 1e-6]
        holding = [level for level in of_height if level.holds(box)[0]]
        assert len(holding) <= 1
        resolved = (window > 1.2 * smallest).all() and (window <= [width, height]).all()
        if resolved and share(step, centre, thing) > MIN_FITTING + 0.35:
            (level,) = holding
            assert level.window[0] == pytest.approx(window[0], rel=0.25)
            searched += 1
        elif share(step, centre, 2 * thing) == 0 or (window < smallest / 1.2).any():
            assert holding == []
            passed_by += 1
    assert searched > 30
    assert passed_by > 1000


@st.composite
def masks(draw):
    """A mask with a few blocks, and widths that vary along rows and columns."""
    shape = draw(st.tuples(st.integers(1, 40), st.integers(1, 60)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    mask = np.zeros(shape, np.bool_)
    for _ in range(draw(st.integers(0, 5))):
        y, x = rng.integers(shape[0]), rng.integers(shape[1])
        mask[y : y + rng.integers(1, 15), x : x + rng.integers(1, 25)] = True
    slope = draw(st.tuples(st.floats(-2, 2), st.floats(-2, 2)))
    y, x = np.mgrid[: shape[0], : shape[1]]
    widths = np.exp(slope[0] * y / shape[0] + slope[1] * x / shape[1]).astype(np.float32)
    return mask, widths, draw(st.floats(2, 8))


@given(masks())
def test_every_marked_cell_is_in_one_part_with_windows_of_about_its_width(case):
    mask, widths, height = case
    parts = parts_of(mask, widths, height)
    count = np.zeros(mask.shape, int)
    for part in parts:
        count[part.rows, part.columns] += 1
        inside = widths[part.rows, part.columns][mask[part.rows, part.columns]]
        wrong = np.maximum(inside / part.width, part.width / inside).max()
        assert wrong <= np.sqrt(MAX_SPREAD) * 1.001 or count[part.rows, part.columns].size == 1
    assert count.max() <= 1
    assert (count[mask] == 1).all()


@given(masks())
def test_a_part_is_the_rectangle_of_its_marked_cells_with_their_widths(case):
    mask, widths, height = case
    for part in parts_of(mask, widths, height):
        inside = mask[part.rows, part.columns]
        assert inside[0].any() and inside[-1].any() and inside[:, 0].any() and inside[:, -1].any()
        of_cells = widths[part.rows, part.columns][inside]
        assert (part.narrowest, part.widest) == (of_cells.min(), of_cells.max())


def test_parts_leave_out_what_costs_more_than_an_edge():
    widths = np.ones((60, 200), np.float32)
    mask = np.zeros((60, 200), np.bool_)
    mask[:10, :10] = mask[-10:, -10:] = True
    parts = parts_of(mask, widths, 4.0)
    assert sorted((part.rows.start, part.columns.start) for part in parts) == [(0, 0), (50, 190)]
    mask[:] = True
    assert len(parts_of(mask, widths, 4.0)) == 1
    assert parts_of(~mask, widths, 4.0) == []


def test_gray_of_three_planes_and_one_plane_alone():
    image = square((120, 150), (60, 50, 12, 12))
    planes = np.stack([np.full_like(image, 40), image, np.full_like(image, 40)], axis=-1)
    evidence = evidence_of(grid_of((120, 150), (0.2, 0.2)), normals=planes, **{"normals.g": image})
    for name in ("normals", "normals.g"):
        detector = WindowDetector(blob_model(image=name))
        assert detector.images == {name}
        (candidate,) = detector(evidence)
        assert iou([candidate.box], [(60, 50, 12, 12)])[0, 0] > 0.8


@pytest.mark.parametrize("box", [(6, 6, 12, 12), (132, 6, 12, 12), (132, 102, 12, 12), (10, 88, 20, 20)])
def test_the_search_reaches_the_border(box):
    """The outermost window begins or ends with the image."""
    image = square((120, 150), box)
    evidence = evidence_of(grid_of((120, 150), (0.2, 0.2)), range=image)
    size = tuple(np.radians(0.2) * np.array(box[2:]))
    for model in (blob_model(likeness=0.8), blob_model(likeness=0.8, object_size_m=size)):
        (candidate,) = WindowDetector(model)(evidence)
        assert iou([candidate.box], [box])[0, 0] > 0.75


def test_returns_that_do_not_count_are_not_searched_metrically():
    scan, model = grid_of((60, 90)), blob_model(object_size_m=(0.15, 0.2))
    assert list(metric_levels(evidence_of(scan), model.card))
    nothing = evidence_of(scan.with_limits(min_range=5.0), range=square((60, 90), (39, 19, 20, 23)))
    assert list(metric_levels(nothing, model.card)) == []
    assert WindowDetector(model)(nothing) == []


def test_a_model_without_object_size_is_searched_plainly():
    evidence = evidence_of(grid_of((120, 150), (0.2, 0.2)), range=square((120, 150), (60, 50, 12, 12)))
    metric, plain = (WindowDetector(blob_model(), scale)(evidence) for scale in ("metric", "plain"))
    assert [c.box for c in metric] == [c.box for c in plain]
    assert len(plain) == 1


def test_a_grid_smaller_than_the_window_has_no_candidates():
    for shape in ((2, 2), (9, 200), (200, 9)):
        grid = grid_of(shape, (0.2, 0.2))
        for scale in ("plain", "metric"):
            model = blob_model(object_size_m=(0.3, 0.4))
            evidence = evidence_of(grid, range=np.zeros(shape, np.uint8))
            assert WindowDetector(model, scale)(evidence) == []


def test_detectors_that_share_a_scan_find_what_each_finds_alone():
    scan, _ = ball(-45.0)
    images = {kind: make_image(scan, kind) for kind in ("depth_relative", "range")}
    evidence = evidence_of(scan, **images)
    look = {"bright": False, "likeness": 0.5, "object_size_m": (0.35, 0.35)}
    detectors = [WindowDetector(blob_model(image=kind, **look), "metric") for kind in images]
    detectors += [WindowDetector(blob_model(bright=False, likeness=0.5), "plain")]
    searched = Searched(evidence)
    alone = [detector(evidence) for detector in detectors]
    for detector, expected in zip(detectors, alone, strict=True):
        together = [[*one.box, one.score] for one in detector.found(searched)]
        assert np.array(together) == pytest.approx(np.array([[*one.box, one.score] for one in expected]))
    assert len(alone[0]) > 0 and searched.pyramid("range") is searched.pyramid("range")


def test_the_scale_is_metric_or_plain():
    with pytest.raises(ConfigError, match="scale must be metric or plain, not 'both'"):
        WindowDetector(blob_model(), "both")


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.booleans())
def test_metric_search_of_any_scan_gives_boxes_in_the_grid(seed, wraps):
    scan = noisy_scan(seed, wraps)
    rng = np.random.default_rng(seed)
    image = cv2.resize(rng.integers(0, 256, (12, 16), np.uint8), scan.shape[::-1])
    model = blob_model(likeness=0.3, margin=0.1, object_size_m=tuple(rng.uniform(0.2, 1.5, 2)))
    height, width = scan.shape
    for candidate in WindowDetector(model)(evidence_of(scan, range=image)):
        x, y, w, h = candidate.box
        assert 0 <= x < width
        assert 0 <= y < y + h <= height + 1e-6
        assert 0 < w <= width + 1e-6
        assert wraps or x + w <= width + 1e-6
        assert candidate.score >= model.min_neighbours
