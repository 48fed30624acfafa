"""Recipes: what they must say, what a cascade and a second stage are given, and one detector from a mesh."""

import json
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analytic import boxes_and_floor, ray_grid
from laserimg.boxes import iou
from laserimg.cli import main
from laserimg.cli.train_recipe import rules_of
from laserimg.detectors import ranked
from laserimg.detectors.candidate import Candidate
from laserimg.detectors.description import IMAGES, Describer
from laserimg.detectors.look import Look
from laserimg.detectors.ranked import proposer
from laserimg.detectors.search import Searched, WindowDetector
from laserimg.detectors.second_stage import MOST
from laserimg.detectors.second_stage import seen as seen_by_judge
from laserimg.detectors.shipped import detector_files, load_model, shipped_folder
from laserimg.errors import ConfigError, LabelError, ModelError
from laserimg.evidence import Evidence
from laserimg.files import sha256_of
from laserimg.formats.card import Card, read_card, read_card_of
from laserimg.formats.coco import Annotation, Category, CocoFile, CocoImage
from laserimg.formats.coco_file import write_coco
from laserimg.formats.npz import write_npz
from laserimg.images import make_images
from laserimg.pipeline import Finding, Pipeline
from laserimg.recipes import cards, look_samples, observation, proposing, run, scans
from laserimg.recipes.cards import card_of, is_described_by, write_card_beside
from laserimg.recipes.cascade_samples import COPIES, no_samples, samples_of
from laserimg.recipes.drafts import Draft
from laserimg.recipes.from_mesh import recipe_of_mesh, rules_of_mesh
from laserimg.recipes.gloss import without_glancing
from laserimg.recipes.look_samples import Proposed, Samples, samples_of_look
from laserimg.recipes.measuring import StepScore, _found, matched, pipeline_of, sent
from laserimg.recipes.proposals import proposals, proposed_boxes
from laserimg.recipes.proposing import train_proposer
from laserimg.recipes.recipe import read_recipe
from laserimg.recipes.scoring import overlap_after, trained_judge
from laserimg.recipes.threshold import _passed, chances
from laserimg.rules.checks import FAR_CHECKS, Check
from laserimg.rules.file import load_rules, parse_rules
from laserimg.rules.model import ClassRules, Interval
from laserimg.simulate.user_mesh import UserThing, user_thing
from window_models import blob_xml

RECIPE = """format = 1
class = "wastebasket"
seed = 3

[[scans]]
scene = "corridor"
scanner = "lms200_swing"
count = 20

[[scans]]
scene = "office"
scanner = "lms200_turn"
count = 10
more = ["office_chair", "desk"]

[[cascade]]
name = "depth"
image = "depth_relative"
window = [20, 24]
object_size_m = [0.3, 0.36]
"""
TRAINING = Path(__file__).parents[1] / "training"
GRID = ray_grid(np.arange(40.0, -40.0, -0.5), np.arange(5.0, -45.0, -0.5))
BOX = ((2.0, -0.15, -1.5), (2.3, 0.15, -1.14))


def written(tmp_path, text):
    path = tmp_path / "bin.toml"
    path.write_text(text)
    return path


def test_a_recipe_is_read_and_scaled(tmp_path):
    recipe = read_recipe(written(tmp_path, RECIPE))
    assert (recipe.label, recipe.seed, recipe.regions) == ("wastebasket", 3, True)
    assert recipe.cascades[0].window == (20, 24)
    assert recipe.scaled(0.5).scans[1].count == 5 and recipe.scaled(0.001).scans[1].count == 1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("seed = 3", "sead = 3", "bin.toml:3: unknown key 'sead', did you mean 'seed'"),
        ("count = 10", "count = 0", r"bin.toml:13: scans\[1\].count should be greater"),
        ('image = "depth_relative"', 'image = "depth"', "unknown image 'depth'; known are"),
        ("wastebasket", "wastebaskt", "toml:2: unknown class 'wastebaskt', did you mean 'wastebasket'"),
        ('"office"', '"ofice"', "bin.toml:11: unknown scene 'ofice', did you mean 'office'"),
        (
            "lms200_turn",
            "lms200_trun",
            "bin.toml:12: unknown scanner 'lms200_trun', did you mean 'lms200_turn'",
        ),
        ("office_chair", "ofice_chair", "toml:14: unknown thing 'ofice_chair', did you mean 'office_chair'"),
        ("format = 1\n", "", "must begin with format = 1"),
        (
            "seed = 3",
            'neutral = ["litter_bn"]',
            "toml:3: unknown class 'litter_bn', did you mean",
        ),
        ("seed = 3", 'neutral = ["wastebasket"]', "bin.toml:3: wastebasket is what the recipe learns"),
        (RECIPE[RECIPE.index("[[casc") :], "regions = false", "unknown key 'regions'"),
        (
            RECIPE,
            RECIPE[: RECIPE.index("[[casc")].replace("seed = 3", "regions = false"),
            "needs a cascade, or",
        ),
    ],
)
def test_a_wrong_recipe_names_line_and_key(tmp_path, old, new, message):
    with pytest.raises(ConfigError, match=message):
        read_recipe(written(tmp_path, RECIPE.replace(old, new)))


def observed(scan) -> Evidence:
    seen = Pipeline(parse_rules("format = 1\n")).observe(scan)
    return replace(seen, images=make_images(scan, IMAGES))


def test_a_cascade_is_given_the_object_and_no_view_hides_where_it_is():
    seen = observed(boxes_and_floor(GRID, [BOX], noise_m=0.0))
    (region,) = seen.regions
    card = Card("bin", "haar", "depth_relative", (20, 24), "0" * 64, object_size_m=(0.3, 0.36), margin=0.15)
    boxes = np.array([region.box])
    samples = samples_of(seen, card, boxes, np.empty((0, 4)), np.random.default_rng(0))
    assert samples.positives.shape == (COPIES, 24, 20)
    # Nearer than its surroundings inside, farther or as far at the upper edge.
    first = samples.positives[0].astype(int)
    assert first[8:16, 7:13].mean() < first[:2].mean() - 10
    for image, there in samples.views:
        assert image.shape[0] >= 24 and image.shape[1] >= 20 and there.shape == (1, 4)
    # In the view at its own scale the object is about as large as the window without its margin.
    sizes = [there[0, 2:] for _, there in samples.views]
    assert min(np.abs(np.log(size / np.array([20, 24]) * 1.3)).max() for size in sizes) < 0.35


def test_an_object_of_another_shape_than_the_window_is_not_learnt():
    seen = observed(boxes_and_floor(GRID, [BOX], noise_m=0.0))
    card = Card("bin", "haar", "depth_relative", (40, 12), "0" * 64, object_size_m=(2.0, 0.3))
    boxes = np.array([seen.regions[0].box])
    assert len(samples_of(seen, card, boxes, np.empty((0, 4)), np.random.default_rng(0)).positives) == 0


@settings(deadline=None)
@given(st.floats(0.5, 3), st.floats(-2, 2), st.floats(0.5, 3), st.integers(0, 99))
def test_chances_are_those_that_hits_were_drawn_with(slope, shift, odds, seed):
    rng = np.random.default_rng(seed)
    margins, passed = rng.normal(0, 2, 6000), rng.uniform(size=6000) < 0.5
    hits = rng.uniform(size=6000) < 1 / (1 + np.exp(-(slope * margins + shift + odds * passed)))
    assert chances(margins, passed, hits) == pytest.approx((slope, shift, odds), abs=0.5)


@settings(deadline=None)
@given(st.integers(0, 9999))
def test_what_a_box_overlaps_after_its_correction_is_what_iou_says(seed):
    rng = np.random.default_rng(seed)
    boxes = np.concatenate([rng.uniform(0, 50, (9, 2)), rng.uniform(5, 20, (9, 2))], axis=1)
    moves = rng.uniform(-0.4, 0.4, (9, 4))
    look = Look(
        np.zeros(9, np.float32), 0.0, np.float32(rng.uniform(-0.3, 0.3, (4, 9))), np.float32([0, 0.1, 0, 0])
    )
    vectors = np.eye(9, dtype=np.float32)
    middle, size = boxes[:, :2] + boxes[:, 2:] * (0.5 + moves[:, :2]), boxes[:, 2:] * np.exp(moves[:, 2:])
    wanted = iou(look.corrected(boxes, vectors), np.concatenate([middle - size / 2, size], axis=1)).diagonal()
    samples = Samples(vectors.astype(np.float16), vectors, np.ones(9, np.float32), moves.astype(np.float32))
    assert overlap_after(look, samples) == pytest.approx(wanted, abs=1e-3)


def test_the_judge_learns_from_boxes_that_the_last_correction_puts_on_their_object():
    """Of 3 kinds of box, told apart by a number each: on the object, off it, put on it by the correction."""
    kinds = np.repeat(np.eye(3, dtype=np.float32), 80, axis=0)
    moves = np.zeros((240, 4), np.float32)
    moves[80:160, 0], moves[160:, 0] = 0.45, 0.45
    look = Look(
        np.zeros(3, np.float32),
        0.0,
        np.float32([[0, 0, 0.45], [0] * 3, [0] * 3, [0] * 3]),
        np.zeros(4, np.float32),
    )
    overlap = np.repeat(np.float32([1.0, 0.37, 0.37]), 80)
    judge = trained_judge(Samples(kinds.astype(np.float16), kinds, overlap, moves), look)
    on, off, put = judge(np.eye(3, dtype=np.float32))
    assert on > 0 > off and put == pytest.approx(on)


@pytest.fixture
def laserimg(tmp_path, monkeypatch, capsys):
    """Run the command line in an empty folder: exit code, output, errors."""

    def run(*arguments):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["laserimg", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            main()
        return stop.value.code or 0, *capsys.readouterr()

    return run


def bin_mesh(path):
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("embreex")
    trimesh.creation.cylinder(radius=0.42, height=1.0, sections=24).export(path)
    return path


def test_too_few_scans_to_learn_from_are_an_error_in_one_line(tmp_path, laserimg):
    mesh = bin_mesh(tmp_path / "bin.obj")
    code, _, error = laserimg(
        "train",
        "from-mesh",
        mesh,
        "--class",
        "bin",
        "--height",
        "0.3:0.5",
        "-o",
        tmp_path / "bin",
        "--scans",
        2,
    )
    assert code == 1 and error.count("\n") == 1 and "needed: more scans" in error
    assert not (tmp_path / "bin" / "rules.toml").exists()


def test_a_cascade_is_trained_again_only_if_its_recipe_or_file_changed(tmp_path):
    recipe = read_recipe(written(tmp_path, RECIPE))
    path = tmp_path / "bin.depth.xml"
    path.write_bytes(blob_xml())
    card = card_of(recipe, recipe.cascades[0], 10)
    assert not is_described_by(path, card)
    write_card_beside(path, card, stages=1)
    assert is_described_by(path, card)
    path.write_bytes(blob_xml() + b" ")
    assert not is_described_by(path, card)


def test_evidence_is_kept_until_the_program_changes(tmp_path, monkeypatch):
    scan = boxes_and_floor(GRID, [BOX], noise_m=0.0)
    path = tmp_path / "a.npz"
    write_npz(scan, path)
    first = observation.observed(path)
    kept = path.with_suffix(".evidence")
    made = kept.stat().st_mtime_ns
    again = observation.observed(path)
    assert kept.stat().st_mtime_ns == made and [one.box for one in again.regions] == [
        one.box for one in first.regions
    ]
    np.testing.assert_array_equal(again.images["normals_view.g"], first.images["normals_view"][..., 1])
    assert again.floor.height_below_m == pytest.approx(1.5, abs=0.01)
    kept.write_bytes(kept.read_bytes()[:1000])
    assert len(observation.observed(path).regions) == len(first.regions)
    made = kept.stat().st_mtime_ns
    monkeypatch.setattr(observation, "sources_sha256", lambda folder: "another")
    observation.observed(path)
    assert kept.stat().st_mtime_ns > made


def test_the_parts_of_a_recipe_share_no_scan_and_look_for_its_class(tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr(scans, "make_scans", lambda plan, count, jobs: made.append(plan) or range(count))
    recipe = read_recipe(written(tmp_path, RECIPE))
    parts = {part: scans.scans_of(recipe, part, tmp_path, 1) for part in ("train", "tune", "test")}
    assert {part: len(found) for part, found in parts.items()} == {"train": 30, "tune": 6, "test": 6}
    assert len({plan.seed for plan in made}) == 3 and {plan.seed for plan in made} >= {3}
    assert len({one.path for found in parts.values() for one in found}) == 42
    assert [extra.label for extra in made[1].extras] == ["office_chair", ""]


def truth_of_scan(folder, things):
    """A truth on disk of class, returns and visibility of things in a row."""
    boxes = [
        Annotation(number, 1, category, (number, 0, 5, 5), area=area, visibility=visibility)
        for number, (category, area, visibility) in enumerate(things, 1)
    ]
    categories = Category(1, "wastebasket"), Category(2, "car"), Category(3, "litter_bin")
    truth = folder / "truth.json"
    write_coco(truth, CocoFile((CocoImage(1, "a.npz", 100, 50),), categories, tuple(boxes)))
    return truth


def files_of(recipe, part, work, monkeypatch):
    """The scans of a part, of which none is made."""
    monkeypatch.setattr(scans, "make_scans", lambda plan, count, jobs: range(count))
    return [one.path for one in scans.scans_of(recipe, part, work, 1)]


@pytest.mark.parametrize("file", sorted(TRAINING.glob("*.toml")), ids=lambda path: path.stem)
def test_no_scan_of_a_recipe_is_learnt_twice_and_it_sees_rooms_and_outdoors(file, tmp_path, monkeypatch):
    recipe = read_recipe(file)
    for part in ("train", "tune", "test"):
        paths = files_of(recipe, part, tmp_path, monkeypatch)
        assert len(set(paths)) == len(paths) == scans.count_of(recipe, part)
    scenes = {one.scene for one in recipe.scans}
    assert scenes & {"office", "corridor", "stairwell"} and scenes >= {"street", "park"}
    assert "lms151_turn" in {one.scanner for one in recipe.scans}
    # Some rooms have no more things of the class than rooms have by themselves.
    if recipe.label in ("wastebasket", "office_chair", "door", "window", "stairs"):
        assert ("office", ()) in {(one.scene, one.more) for one in recipe.scans}


def test_recipes_share_their_scans(tmp_path, monkeypatch):
    recipes = [read_recipe(file) for file in TRAINING.glob("*.toml")]
    files = {
        path
        for recipe in recipes
        for part in ("train", "tune", "test")
        for path in files_of(recipe, part, tmp_path, monkeypatch)
    }
    assert len(files) < 5600


def test_scans_are_counted_while_they_are_made(tmp_path, monkeypatch):
    told = []
    monkeypatch.setattr(scans, "make_scans", lambda plan, count, jobs: reversed(range(count)))
    scans.scans_of(read_recipe(written(tmp_path, RECIPE)), "train", tmp_path, 1, (), told.append)
    assert told == list(range(1, 31))


def test_objects_that_show_too_little_are_neither_learnt_nor_missed(tmp_path):
    recipe = read_recipe(written(tmp_path, RECIPE))
    things = [  # class, returns, visibility
        (1, 50, 0.5), (1, 49, 1.0), (1, 500, 0.49), (1, 500, None), (2, 500, 1.0),
    ]  # fmt: skip
    asked, ignored = scans.TrainingScan(tmp_path / "a.npz", truth_of_scan(tmp_path, things)).objects(recipe)
    assert (asked[:, 0].tolist(), ignored[:, 0].tolist()) == ([1, 4], [2, 3])


def test_what_is_neutral_is_neither_learnt_nor_background_however_clear_it_is(tmp_path):
    truth = truth_of_scan(tmp_path, [(1, 500, 1.0), (2, 500, 1.0), (3, 500, 1.0), (3, 20, 0.1)])
    scan = scans.TrainingScan(tmp_path / "a.npz", truth)
    recipe = read_recipe(written(tmp_path, RECIPE.replace("seed = 3", 'neutral = ["litter_bin"]')))
    asked, ignored = scan.objects(recipe)
    assert (asked[:, 0].tolist(), ignored[:, 0].tolist()) == ([1], [3, 4])
    asked, ignored = scan.objects(replace(recipe, neutral=()))
    assert (asked[:, 0].tolist(), ignored[:, 0].tolist()) == ([1], [])


def test_a_detection_of_something_neutral_is_neither_hit_nor_false_positive():
    asked, neutral = np.array([[0.0, 0, 10, 10]]), np.array([[40.0, 0, 10, 20]])
    boxes = [((0.0, 0.0, 10.0, 10.0), 0.9), ((40.0, 0.0, 10.0, 18.0), 0.8), ((70.0, 0.0, 10.0, 10.0), 0.7)]
    found = matched(boxes, asked, neutral, None)
    assert (found.scores.tolist(), found.hits.tolist()) == ([0.9, 0.7], [True, False])


def proposed_beside(box, folder):
    """A scan on disk, and proposals: the object, half of it, nothing, and what is kept out."""
    write_npz(boxes_and_floor(GRID, [BOX], noise_m=0.0), folder / "a.npz")
    x, y, w, h = box
    boxes = np.array([[x, y, w, h], [x + w / 3, y, w, h], [3.0, 3, 20, 20], [100.0, 40, 10, 12]])
    scan = scans.TrainingScan(folder / "a.npz", folder / "a.json")
    return Proposed(0, scan, boxes, boxes[:1], boxes[3:])


def test_a_look_learns_boxes_where_the_look_before_has_put_them(tmp_path):
    seen = observed(boxes_and_floor(GRID, [BOX], noise_m=0.0))
    recipe = replace(read_recipe(written(tmp_path, RECIPE)), shadows=0.0)
    one = proposed_beside(seen.regions[0].box, tmp_path)
    first, left = samples_of_look(recipe, (), [one], 1)
    assert np.array_equal(left[0].boxes, one.boxes)
    # The object, what is half on it, its copies, and nothing; what is kept out is not among them.
    assert first.overlap[0] == 1 and first.overlap[1] == pytest.approx(0.5, abs=0.01)
    assert first.moves[0] == pytest.approx([0, 0, 0, 0]) and first.moves[1] == pytest.approx(
        [-1 / 3, 0, 0, 0]
    )
    assert (first.overlap < 0.35).sum() >= 1 and first.numbers.shape == (len(first.overlap), 0)
    describe = Describer.of(observation.observed(one.scan.path))
    nothing = describe(one.boxes[2:3]).astype(np.float16)[0]
    kept_out = describe(one.boxes[3:]).astype(np.float16)[0]
    assert (first.vectors == nothing).all(axis=1).any()
    assert not (first.vectors == kept_out).all(axis=1).any()

    length = first.vectors.shape[1]
    weights = np.random.default_rng(0).normal(size=length).astype(np.float32)
    still = np.float32([1 / 3, 0, 0, 0])
    look = Look(weights, 0.5, np.zeros((4, length), np.float32), still)
    second, _ = samples_of_look(recipe, (look,), [one], 1, judged=True)
    # The look has moved all by a third of their width: what was the object is now half on it.
    assert second.overlap[0] == pytest.approx(0.5, abs=0.01)
    moved = look.corrected(one.boxes[:1], np.zeros((1, length), np.float32))
    np.testing.assert_array_equal(second.vectors[0], describe(moved).astype(np.float16)[0])
    np.testing.assert_array_equal(second.numbers[0], seen_by_judge(describe, moved, describe(moved))[0])


def test_only_the_most_promising_proposals_reach_the_second_look(tmp_path):
    seen = observed(boxes_and_floor(GRID, [BOX], noise_m=0.0))
    recipe = replace(read_recipe(written(tmp_path, RECIPE)), shadows=0.0)
    one = proposed_beside(seen.regions[0].box, tmp_path)
    rng = np.random.default_rng(1)
    many = np.concatenate([rng.uniform(0, 60, (MOST + 20, 2)), rng.uniform(8, 30, (MOST + 20, 2))], axis=1)
    one = replace(one, boxes=many)
    vectors = Describer.of(observation.observed(one.scan.path))(many)
    weights = rng.normal(size=vectors.shape[1]).astype(np.float32)
    look = Look(weights, 0.0, np.zeros((4, len(weights)), np.float32), np.zeros(4, np.float32))
    _, (left,) = samples_of_look(recipe, (look,), [one], 1)
    best = np.sort(np.argsort(-(vectors @ weights))[:MOST])
    np.testing.assert_array_equal(left.boxes, many[best])


@pytest.mark.parametrize("way", ["shadows", "gloss"])
def test_copies_without_some_returns_teach_nothing_of_what_is_kept_out(tmp_path, monkeypatch, way):
    seen = observed(boxes_and_floor(GRID, [BOX], noise_m=0.0))
    recipe = replace(read_recipe(written(tmp_path, RECIPE)), **{"shadows": 0.0, "gloss": 0.0, way: 1.0})
    one = replace(proposed_beside(seen.regions[0].box, tmp_path), boxes=np.empty((0, 4)))
    monkeypatch.setattr(
        look_samples, "_copies", lambda boxes, rng: np.array([[3.0, 3, 20, 20], *one.kept_out])
    )
    samples, _ = samples_of_look(recipe, (), [one], 1)
    # Once in the scan as it is, once in its copy: the box of nothing alone.
    assert samples.overlap.tolist() == [0, 0]
    samples, _ = samples_of_look(recipe, (), [replace(one, kept_out=np.empty((0, 4)))], 1)
    assert samples.overlap.tolist() == [0, 0, 0, 0]


def test_what_is_learnt_from_and_measured_is_what_runs(tmp_path, monkeypatch):
    """Coarse search, and of what it finds the best of each cascade."""
    crowd = [((2.0, y, -1.5), (2.3, y + 0.3, -1.14)) for y in (-1.5, -0.9, -0.3, 0.3, 0.9)]
    write_npz(boxes_and_floor(GRID, crowd, noise_m=0.0), tmp_path / "a.npz")
    evidence = observation.observed(tmp_path / "a.npz")
    cascade = shipped_folder() / "wastebasket.depth.xml"
    model = load_model(cascade)
    found = sorted(proposer(model)(evidence), key=lambda one: -one.score)
    assert len(found) > 4 and len(WindowDetector(model)(evidence)) != len(found)
    monkeypatch.setattr(ranked, "MOST_PROPOSED", 3)
    stage = load_model(shipped_folder() / "wastebasket.npz")
    runs = list(
        ranked.RankedDetector((stage,), (proposer(model),))._proposed("wastebasket", Searched(evidence))
    )
    best = [one.box for one in found[:3]]
    assert [one.box for one in proposals(evidence, (cascade,))] == [one.box for one in runs] == best
    boxes = proposed_boxes(evidence, (cascade,), regions=True)
    np.testing.assert_array_equal(boxes, [*best, *(region.box for region in evidence.regions)])
    truth = truth_of_scan(tmp_path, [])
    recipe, rules = read_recipe(written(tmp_path, RECIPE)), sent(load_rules()["wastebasket"])
    models = cascade, shipped_folder() / "wastebasket.npz"
    steps, _ = _found(recipe, models, rules, scans.TrainingScan(tmp_path / "a.npz", truth))
    assert steps["cascades alone"].scores.tolist() == [one.score for one in found[:3]]


BAD_INPUT = {
    "folder": ("recipe . -o out", "laserimg: .: cannot be read: Is a directory"),
    "missing": ("recipe nope.toml -o out", "nope.toml: no such file"),
    "empty": ("recipe empty.toml -o out", "empty.toml:1: a recipe must begin with format = 1"),
    "no TOML": ("recipe broken.toml -o out", "broken.toml:2: "),
    "out is a file": ("recipe bin.toml -o empty.toml", "empty.toml: Not a directory"),
    "out is not writable": ("recipe bin.toml -o /proc/self", "/proc/self: "),
    "missing mesh": ("from-mesh nope.obj --class bin --height 0.2:0.6 -o out", "nope.obj: no such file"),
    "empty mesh": ("from-mesh empty.glb --class bin --height 0.2:0.6 -o out", "empty.glb: is empty"),
    "no mesh": ("from-mesh text.obj --class bin --height 0.2:0.6 -o out", "text.obj: holds no triangles"),
    "no STL": (
        "from-mesh junk.stl --class bin --height 0.2:0.6 -o out",
        "junk.stl: cannot be read as a mesh",
    ),
    "reversed": ("from-mesh text.obj --class bin --height 0.6:0.2 -o out", "height 0.6:0.2: two lengths"),
    "0": ("from-mesh text.obj --class bin --height 0 -o out", "height 0:0: two lengths in metres above 0"),
    "nan": ("from-mesh text.obj --class bin --height nan -o out", "height nan:nan: two lengths"),
    "class": ("from-mesh text.obj --class é --height 1 -o out", "'é' is not made of small letters"),
    "scene": ("from-mesh text.obj --class a --height 1 -o out --scene moon", "known: corridor, office, park"),
}


@pytest.mark.parametrize(("words", "message"), BAD_INPUT.values(), ids=BAD_INPUT)
def test_bad_input_is_one_line_and_leaves_nothing(tmp_path, laserimg, words, message):
    pytest.importorskip("trimesh")
    written(tmp_path, RECIPE)
    for name, data in {
        "empty.toml": b"",
        "broken.toml": b"a = [\n",
        "empty.glb": b"",
        "text.obj": b"hello",
    }.items():
        (tmp_path / name).write_bytes(data)
    (tmp_path / "junk.stl").write_bytes(bytes(range(1, 256)))
    before = set(tmp_path.rglob("*"))
    code, out, error = laserimg("train", *words.split())
    assert code in (1, 2) and out == "" and message in error
    assert code == 2 or error.count("\n") == 1
    assert set(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("old", "new", "anew"),
    [
        ("seed = 3", "seed = 4", True),
        ("seed = 3", "seed = 3\nmin_points = 60", True),
        ("seed = 3", "seed = 3\nneutral = ['litter_bin']", True),
        ("seed = 3", "seed = 3\nmin_visibility = 0.4", True),
        ('more = ["office_chair", "desk"]', 'more = ["office_chair"]', True),
        ("count = 20", "count = 21", True),
        ('"lms200_swing"', '"lms200_tilt"', True),
        ("window = [20, 24]", "window = [20, 24]\nstages = 8", True),
        ("window = [20, 24]", "window = [20, 24]\nfeatures = 'all'", True),
        ("window = [20, 24]", "window = [20, 24]\nnegatives = 2000", True),
        ("window = [20, 24]", "window = [20, 24]\nmax_trees = 50", True),
        ("window = [20, 24]", "window = [20, 24]\nmin_hit_rate = 0.99", True),
        ("window = [20, 24]", "window = [20, 24]\nmin_hit_rate = 0.999", False),
        ("seed = 3", "seed = 3\ncost = 1.0\nshadows = 0.0\nheld_out = 0.1\nregions = false", False),
    ],
)
def test_a_cascade_is_trained_again_if_what_it_depends_on_changed(tmp_path, old, new, anew):
    path = tmp_path / "bin.depth.xml"
    path.write_bytes(blob_xml())
    first, changed = (read_recipe(written(tmp_path, text)) for text in (RECIPE, RECIPE.replace(old, new)))
    write_card_beside(path, card_of(first, first.cascades[0], 30), stages=1)
    assert is_described_by(path, card_of(changed, changed.cascades[0], 30)) is not anew


def test_a_cascade_is_trained_again_if_the_mesh_changed(tmp_path):
    recipe = read_recipe(written(tmp_path, RECIPE))
    (tmp_path / "bin.obj").write_text("v 0 0 0")
    things = [UserThing(tmp_path / "bin.obj", "bin", (0.3, 0.5), "z", f"bin_{n}") for n in "12"]
    one, other = (card_of(recipe, recipe.cascades[0], 10, [thing]) for thing in things)
    assert one != other and one == card_of(recipe, recipe.cascades[0], 10, things[:1])
    # A second stage says the same, and both name the mesh.
    one, other = (card_of(recipe, None, 10, [thing]) for thing in things)
    assert one.recipe_sha256 != other.recipe_sha256
    assert one.trained_on.endswith(f"with bin.obj (sha256 {sha256_of(tmp_path / 'bin.obj')})")


def test_a_detector_is_trained_again_if_the_simulator_or_its_recipe_changed(tmp_path, monkeypatch):
    recipe = read_recipe(written(tmp_path, RECIPE))
    before = [card_of(recipe, one, 30) for one in (recipe.cascades[0], None)]
    dearer = [card_of(replace(recipe, cost=1.0), one, 30) for one in (recipe.cascades[0], None)]
    assert before[0] == dearer[0] and before[1].recipe_sha256 != dearer[1].recipe_sha256
    simulator = before[0].versions["simulator"]
    monkeypatch.setattr(cards, "sources_sha256", lambda folder: "another")
    after = [card_of(recipe, one, 30) for one in (recipe.cascades[0], None)]
    assert all(one.recipe_sha256 != other.recipe_sha256 for one, other in zip(before, after, strict=True))
    assert card_of(recipe, None, 30, simulator=simulator) == before[1]


def test_only_what_says_so_has_a_licence(tmp_path):
    recipe = read_recipe(written(tmp_path, RECIPE))
    assert card_of(recipe, None, 30).licence == ""
    licensed = read_recipe(written(tmp_path, RECIPE.replace("seed = 3", 'licence = "MIT"')))
    assert card_of(licensed, None, 30).licence == "MIT"
    assert {read_recipe(file).licence for file in TRAINING.glob("*.toml")} == {"Apache-2.0"}


@pytest.mark.parametrize(
    ("scene", "scanners"),
    [
        ("office", ("lms200_turn", "lms200_tilt")),
        ("stairwell", ("lms200_turn", "lms200_tilt")),
        ("street", ("spinning128", "spinning64", "terrestrial")),
        ("park", ("spinning128", "spinning64", "terrestrial")),
    ],
)
def test_a_mesh_is_seen_by_the_scanners_of_its_place(tmp_path, scene, scanners):
    recipe = recipe_of_mesh(user_thing(bin_mesh(tmp_path / "bin.obj"), "bin", (0.3, 0.5)), scene, 60, 0)
    assert tuple(one.scanner for one in recipe.scans) == scanners
    assert {(one.scene, one.count) for one in recipe.scans} == {(scene, 60 // len(scanners))}
    assert recipe.licence == ""


def training_of_fakes(monkeypatch, folder, chances_of):
    """Train the wastebasket's recipe with nothing to learn: a blob and the stage that ships."""
    recipe = read_recipe(written(folder, RECIPE))
    shipped = load_model(shipped_folder() / "wastebasket.npz")

    def proposer_of(recipe, cascade, scans, draft, jobs, extras, tell):
        path = draft.draft / "wastebasket.depth.xml"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(blob_xml((20, 24)))
        write_card_beside(path, card_of(recipe, cascade, 30), stages=1)
        return path

    def scores_of(recipe, models, rules, scans, jobs, tell):
        assert rules.score == 0.35
        assert models == [folder / "wastebasket.depth.xml", folder / "wastebasket.npz"]
        assert load_model(models[1]).shift == 7
        return [StepScore("as shipped", 0.5, 0.5, 0.5, 1, 1)]

    monkeypatch.setattr(run, "scans_of", lambda *given: [])
    monkeypatch.setattr(run, "train_proposer", proposer_of)
    monkeypatch.setattr(run, "train_second_stage", lambda recipe, card, *given: replace(shipped, card=card))
    monkeypatch.setattr(run, "fused", lambda stage, *given: stage)
    monkeypatch.setattr(run, "with_chances", chances_of)
    monkeypatch.setattr(run, "least_score", lambda *given: 0.35)
    monkeypatch.setattr(run, "measured", scores_of)
    there = run.TrainingRun(folder / "work", folder, 1)
    return run.follow(
        recipe, there, load_rules()["wastebasket"], lambda *given: nullcontext(lambda done: None)
    )


def test_a_killed_training_leaves_the_detector_of_before_and_no_other(tmp_path, monkeypatch):
    for file in shipped_folder().glob("wastebasket.*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    before = {path.name: path.read_bytes() for path in tmp_path.glob("wastebasket.*")}
    assert len(before) == 4

    def killed(stage, models, *given):
        assert load_model(models[-1]).name == "wastebasket"
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        training_of_fakes(monkeypatch, tmp_path, killed)
    assert {path.name: path.read_bytes() for path in tmp_path.glob("wastebasket.*")} == before
    for name in before:
        (tmp_path / name).unlink()
    with pytest.raises(KeyboardInterrupt):
        training_of_fakes(monkeypatch, tmp_path, killed)
    with pytest.raises(ModelError, match="no detectors in it"):
        detector_files(tmp_path)


def test_a_finished_training_leaves_a_whole_detector_and_nothing_else(tmp_path, monkeypatch):
    training_of_fakes(monkeypatch, tmp_path, lambda stage, *given: replace(stage, shift=7.0))
    names = {path.name for path in tmp_path.iterdir()} - {"bin.toml"}
    assert names == {f"wastebasket{end}" for end in (".npz", ".toml", ".depth.xml", ".depth.toml")}
    card = read_card_of(tmp_path / "wastebasket.npz")
    assert card.scores == {"ap50 as shipped": 0.5, "score": 0.35} and card.recipe_sha256 is not None


@pytest.mark.parametrize("place", ["folder", "draft"])
def test_a_cascade_that_is_there_is_kept_wherever_it_is(tmp_path, monkeypatch, place):
    recipe, draft = read_recipe(written(tmp_path, RECIPE)), Draft(tmp_path, "wastebasket")
    path = getattr(draft, place) / "wastebasket.depth.xml"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(blob_xml((20, 24)))
    write_card_beside(path, card := card_of(recipe, recipe.cascades[0], 0), stages=1)
    monkeypatch.setattr(proposing, "in_order", lambda *given: [no_samples(card)])
    assert train_proposer(recipe, recipe.cascades[0], [], draft, 1) == path
    with pytest.raises(LabelError, match="0 windows of objects"):
        train_proposer(replace(recipe, seed=9), recipe.cascades[0], [], draft, 1)


@pytest.mark.parametrize("file", sorted(TRAINING.glob("*.toml")), ids=lambda path: path.stem)
def test_the_detectors_that_ship_are_those_of_their_recipes(file):
    recipe = read_recipe(file)
    second = shipped_folder() / f"{recipe.label}.npz"
    if read_card_of(second).recipe_sha256 is None:
        pytest.skip("trained before cards of second stages named their recipe")
    scans = sum(one.count for one in recipe.scans)
    for cascade in (*recipe.cascades, None):
        path = second if cascade is None else shipped_folder() / f"{recipe.label}.{cascade.name}.xml"
        old = read_card_of(path)
        # Trained with the programs on their cards, whatever is installed here.
        card = card_of(recipe, cascade, scans, simulator=old.versions["simulator"])
        assert is_described_by(path, replace(card, versions=old.versions, scores=old.scores))


def test_every_cascade_that_ships_has_a_recipe():
    recipes = [read_recipe(file) for file in TRAINING.glob("*.toml")]
    made = {f"{recipe.label}.{one.name}.xml" for recipe in recipes for one in recipe.cascades}
    assert made == {path.name for path in shipped_folder().glob("*.xml")}


@pytest.mark.parametrize(
    "name, counts", [("height", True), *((one, False) for one in (*FAR_CHECKS, "score"))]
)
def test_what_passing_is_worth_is_asked_of_the_checks_that_only_doubt(name, counts):
    """What rejects by itself, as the score and the rectangle do, leaves nothing to be worth."""
    failed = Check(name, 1.0, Interval(None, 0.5), False, "too much")
    finding = Finding(
        Candidate("bin", (0.0, 0.0, 1.0, 1.0), 0.5, "cascade", "bin"), 0.5, None, None, (failed,), False, ""
    )
    assert _passed(finding) == (not counts)


def test_workers_judge_by_all_of_the_rules_but_their_score(tmp_path):
    limits = {"height": Interval(0.2, 0.6)}
    rules = ClassRules("bin", ("regions",), limits, 0.1, 0.2, 0.9, 2, "doubt")
    (asked,) = pipeline_of((), sent(rules), False).rules
    assert asked == replace(rules, score=0.0)
    (gated,) = pipeline_of((), sent(rules), True).rules
    assert gated == replace(rules, score=0.0, on_fail="reject")


def test_rules_of_a_mesh_or_of_no_file_are_as_lenient_as_those_that_ship(tmp_path):
    mesh = bin_mesh(tmp_path / "bin.obj")
    made = parse_rules(rules_of_mesh(user_thing(mesh, "bin", (0.3, 0.5)), 0.25))["bin"]
    shipped = load_rules()
    assert {one.on_fail for one in (made, rules_of("bin", shipped), *shipped)} == {"doubt"}
    assert rules_of("car", shipped) == shipped["car"]
    assert made.score == 0.25 and made.limits["height"].low == 0.18


@pytest.mark.long
def test_a_mesh_becomes_a_detector_that_finds_most_of_its_like(tmp_path, laserimg):
    mesh = bin_mesh(tmp_path / "bin.obj")
    code, out, error = laserimg(
        "train", "from-mesh", mesh, "--class", "bin", "--height", "0.3:0.5", "-o", tmp_path / "bin",
        "--scans", 120, "--jobs", 2, "--json",
    )  # fmt: skip
    assert code == 0, error
    scores = {one["step"]: one for one in json.loads(out)}
    assert scores["second stage"]["average_precision"] > 0.6
    assert scores["second stage"]["average_precision"] > scores["cascades alone"]["average_precision"]
    card = read_card(tmp_path / "bin" / "bin.toml")
    assert card.label == "bin" and card.kind == "svm" and card.scores
    rules = load_rules(tmp_path / "bin" / "rules.toml")["bin"]
    assert rules.limits["height"].high == pytest.approx(1.15 * 0.5, abs=0.006)
    assert rules.score == card.scores["score"]
    scan = next((tmp_path / "bin" / "simulated").glob("*/*.npz"))
    code, _, error = laserimg(
        "detect", scan, "--cascades", tmp_path / "bin", "--rules", tmp_path / "bin" / "rules.toml",
        "-o", tmp_path / "found", "--quiet",
    )  # fmt: skip
    assert code == 0, error


def test_a_glossy_object_loses_returns_at_glancing_incidence_and_nothing_else_does():
    evidence = observed(boxes_and_floor(GRID, [BOX], noise_m=0.0))
    box = np.array(evidence.regions[0].box)
    glossy = without_glancing(evidence, box, np.random.default_rng(2))
    lost = (evidence.scan.range > 0) & (glossy.scan.range == 0)
    rows, columns = np.nonzero(lost)
    assert lost.sum() >= 5
    assert rows.min() >= box[1] - 1 and rows.max() <= box[1] + box[3]
    assert columns.min() >= box[0] - 1 and columns.max() <= box[0] + box[2]
    cosine = evidence.images["normals_view"][..., 0] / 127.5 - 1
    heights = evidence.floor.height_of((evidence.scan.directions * evidence.scan.range[..., None])[lost])
    assert cosine[lost].max() < 0.6 and heights.min() > 0.2
    assert (glossy.images["normals_view"][lost] == 0).all() and (
        glossy.images["depth_relative"][lost] == 0
    ).all()
    for kind in IMAGES:
        np.testing.assert_array_equal(glossy.images[kind][~lost], evidence.images[kind][~lost])
    without_floor = replace(evidence, floor=None)
    assert without_glancing(without_floor, box, np.random.default_rng(2)) is without_floor
