"""Whole training runs, also killed ones, on images drawn here."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import cv2
import numpy as np
import pytest
from threadpoolctl import threadpool_info

from laserimg.cascade.features import Pool
from laserimg.cascade.folder import Run, one_thread, run_in_folder
from laserimg.cascade.model import Cascade
from laserimg.cascade.stage import StageGoal
from laserimg.cascade.training import Plan, Watcher
from laserimg.cascade.xml import read_cascade_info
from laserimg.errors import ConfigError, LabelError, ModelError
from laserimg.samples.negatives import read_negatives
from laserimg.samples.vec import write_vec

SIDE = 16


def marks(count, seed):
    """Dark crosses on light ground, with noise, turned and moved a little."""
    rng = np.random.default_rng(seed)
    pixels = np.full((count, SIDE, SIDE), 170.0)
    for image in pixels:
        x, y = rng.integers(6, 10, 2)
        image[y - 1 : y + 2, 2:14] -= rng.uniform(50, 110)
        image[2:14, x - 1 : x + 2] -= rng.uniform(50, 110)
    return (pixels + rng.normal(0, 14, pixels.shape)).clip(0, 255).astype(np.uint8)


def clutter(folder, count=12, seed=3):
    """Photographs of bars, blobs and noise."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    for number in range(count):
        small = rng.integers(30, 230, (14, 18)).astype(np.uint8)
        image = cv2.resize(small, (180, 140), interpolation=cv2.INTER_CUBIC)
        for _ in range(25):
            x, y, w, h = rng.integers([0, 0, 3, 3], [160, 120, 40, 40]).tolist()
            cv2.rectangle(image, (x, y), (x + w, y + h), int(rng.integers(256)), 2)
        noisy = image + rng.normal(0, 10, image.shape)
        cv2.imwrite(str(folder / f"{number:02d}.png"), noisy.clip(0, 255).astype(np.uint8))
    return folder


@pytest.fixture
def run(tmp_path):
    backgrounds = read_negatives(clutter(tmp_path / "backgrounds")).images

    def make(name="out", jobs=1, mode="basic", stages=4, search="screened", **more):
        goal = StageGoal(0.95, 0.4, **more)
        plan = Plan(Pool(mode, SIDE, SIDE), goal, stages, negatives=150, seed=7, search=search)
        return Run(plan, marks(120, 1), backgrounds, tmp_path / name, jobs)

    return make


def text(run):
    return run.cascade.read_text()


@pytest.mark.parametrize("mode", ["basic", "all", "lbp"])
def test_a_cascade_is_trained_that_finds_the_marks(run, mode):
    task = run(mode=mode)
    trained = run_in_folder(task, Watcher())
    assert trained.end == "stages" and len(trained.cascade) == 4
    info = read_cascade_info(task.cascade)
    assert (info.stages, info.window) == (4, (SIDE, SIDE))
    detector = cv2.CascadeClassifier(str(task.cascade))
    fresh = marks(200, 99)
    size = (SIDE, SIDE)
    seen = np.array([len(detector.detectMultiScale(mark, 1.1, 0, 0, size, size)) > 0 for mark in fresh])
    assert seen.mean() > 0.75
    assert (trained.cascade.passes(fresh) == seen).all()
    noise = np.random.default_rng(0).integers(0, 256, (300, SIDE, SIDE)).astype(np.uint8)
    assert trained.cascade.passes(noise).mean() < 0.15


def test_records_say_what_happened(run):
    task = run()
    trained = run_in_folder(task, Watcher())
    lines = [json.loads(line) for line in (task.folder / "log.jsonl").read_text().splitlines()]
    assert [line["event"] for line in lines] == ["stage"] * 4 + ["end"]
    for number, (line, record) in enumerate(zip(lines, trained.records, strict=False)):
        part = Cascade(task.plan.pool, trained.cascade.stages[: number + 1])
        assert line["positives_left"] == record.positives_left == part.passes(task.positives).sum()
        assert line["trees"] == len(trained.cascade.stages[number].trees)
        assert record.negatives == 150 and record.hit_rate >= 0.95 and record.false_alarm <= 0.4
    assert trained.records[-1].positives_left < 120
    rates = [record.before.value for record in trained.records]
    assert (np.diff(rates) < 0).all()


def test_threads_and_repetition_do_not_change_the_result(run):
    for task in (first := run("a"), run("b", jobs=2), run("c", jobs=3)):
        run_in_folder(task, Watcher())
        assert text(task) == text(first)
    other = replace(first, plan=replace(first.plan, seed=8), folder=first.folder.parent / "d")
    run_in_folder(other, Watcher())
    assert text(other) != text(first)


class Stop(Watcher):
    """Ends the run by an exception at a stage."""

    def __init__(self, stage):
        self.last = stage

    def tree(self, stage, progress):
        if stage == self.last:
            raise KeyboardInterrupt


@pytest.mark.parametrize("stage", [0, 1, 3])
def test_an_interrupted_run_goes_on(run, stage):
    whole, broken = run("whole"), run("broken")
    run_in_folder(whole, Watcher())
    with pytest.raises(KeyboardInterrupt):
        run_in_folder(broken, Stop(stage))
    if stage:
        assert read_cascade_info(broken.cascade).stages == stage
    run_in_folder(broken, Watcher())
    assert text(broken) == text(whole)


def test_more_stages_go_on_with_those_there_are(run):
    whole, short = run("whole"), run("short", stages=2)
    run_in_folder(whole, Watcher())
    run_in_folder(short, Watcher())
    before = (short.folder / "state" / "stage_01.npz").stat().st_mtime_ns
    longer = replace(short, plan=replace(short.plan, stages=4))
    run_in_folder(longer, Watcher())
    assert text(longer) == text(whole)
    assert (short.folder / "state" / "stage_01.npz").stat().st_mtime_ns == before


def test_the_state_of_another_run_is_not_used(run):
    task = run(stages=1)
    run_in_folder(task, Watcher())
    other = replace(task, plan=replace(task.plan, seed=1))
    with pytest.raises(ConfigError, match="state of a run with other settings"):
        run_in_folder(other, Watcher())
    run_in_folder(other, Watcher(), restart=True)


def test_a_damaged_checkpoint_is_named(run):
    task = run(stages=2)
    run_in_folder(task, Watcher())
    path = task.folder / "state" / "stage_01.npz"
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(ModelError, match=r"stage_01\.npz: damaged"):
        run_in_folder(task, Watcher())


def test_negatives_run_out_plainly(run):
    task = run(stages=40)
    trained = run_in_folder(task, Watcher())
    assert trained.end == "negatives"
    assert 0 < len(trained.cascade) < 40
    assert trained.rate.windows > 0 and trained.rate.high < 0.1
    assert read_cascade_info(task.cascade).stages == len(trained.cascade)


def test_a_target_is_reached(run):
    task = run(stages=40)
    task = replace(task, plan=replace(task.plan, target=0.05))
    trained = run_in_folder(task, Watcher())
    assert trained.end == "target" and trained.rate.high <= 0.05


@pytest.mark.parametrize(
    "options", [{"depth": 2}, {"boost": "real"}, {"search": "exhaustive"}, {"trim": 0.9}]
)
def test_every_way_of_training_gives_a_cascade_that_opencv_agrees_with(run, options):
    task = run(stages=2, **options)
    trained = run_in_folder(task, Watcher())
    detector = cv2.CascadeClassifier(str(task.cascade))
    pixels, size = (
        np.concatenate([marks(60, 5), task.positives[:60].transpose(0, 2, 1)[:, ::-1]]),
        (SIDE, SIDE),
    )
    pixels = np.ascontiguousarray(pixels)
    seen = [len(detector.detectMultiScale(image, 1.1, 0, 0, size, size)) > 0 for image in pixels]
    assert trained.cascade.passes(pixels).tolist() == seen


def command(tmp_path, out):
    options = {
        "--positives": tmp_path / "marks.vec",
        "--negatives": tmp_path / "backgrounds",
        "--window": f"{SIDE}x{SIDE}",
        "--num-neg": 200,
        "--stages": 6,
        "--max-false-alarm": 0.45,
        "--jobs": 1,
        "--out": tmp_path / out,
    }
    start = "from laserimg.cli import main; main()"
    words = [str(word) for option in options.items() for word in option]
    return [sys.executable, "-c", start, "train", "cascade", *words]


class Listener(Watcher):
    def __init__(self):
        self.lines = []

    def left_out(self, lines):
        self.lines += lines


def test_unusable_negatives_are_named(run, tmp_path):
    task = run(stages=1)
    (tmp_path / "backgrounds" / "text.png").write_text("not an image")
    cv2.imwrite(str(tmp_path / "backgrounds" / "tiny.png"), np.zeros((9, 40), np.uint8))
    task = replace(task, backgrounds=read_negatives(tmp_path / "backgrounds").images)
    listener = Listener()
    assert run_in_folder(task, listener).end == "stages"
    assert [line.split("/")[-1] for line in listener.lines] == [
        "text.png: text.png cannot be read as an image",
        "tiny.png: 40x9 is smaller than the window",
    ]
    with pytest.raises(LabelError, match=r"no image to take negatives from; .*40x9 is smaller"):
        run_in_folder(replace(task, backgrounds=task.backgrounds[-1:], folder=tmp_path / "b"), listener)


def test_kill_at_any_moment(tmp_path):
    write_vec(tmp_path / "marks.vec", marks(120, 1))
    clutter(tmp_path / "backgrounds")
    start = time.monotonic()
    subprocess.run(command(tmp_path, "whole"), check=True, capture_output=True)
    whole = time.monotonic() - start
    rng = np.random.default_rng(int(os.environ.get("KILL_SEED", "0")))
    for share in (0.4, *rng.uniform(0.3, 0.95, 2)):
        process = subprocess.Popen(command(tmp_path, "killed"), stdout=subprocess.DEVNULL)
        time.sleep(share * whole)
        process.send_signal(signal.SIGKILL)
        process.wait()
    for folder in (tmp_path / "killed", tmp_path / "killed" / "state"):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".unfinished.cascade.a1.xml").write_text("<half")
    subprocess.run(command(tmp_path, "killed"), check=True, capture_output=True)
    assert (tmp_path / "killed/cascade.xml").read_text() == (tmp_path / "whole/cascade.xml").read_text()
    assert (tmp_path / "killed/cascade.toml").exists()
    assert [p.name for p in (tmp_path / "killed").rglob("*.xml")] == ["cascade.xml"]


def test_libraries_use_one_thread_within_and_as_many_as_before_after():
    def threads():
        return [cv2.getNumThreads(), *(pool["num_threads"] for pool in threadpool_info())]

    before = threads()
    with one_thread():
        assert set(threads()) == {1} and len(threads()) > 1
    assert threads() == before
