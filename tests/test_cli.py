"""What every verb owes: exit codes, one-line errors, nothing half-written, JSON, quiet, examples in help."""

import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import typer

import laserimg as package
from command import laserimg
from laserimg.classify import ObjectModel, Recipe, save_model
from laserimg.cli.app import app

SCANS = Path(package.__file__).parent / "demo"
HEAVY = ["numpy", "cv2", "scipy", "sklearn", "pydantic", "rich", "joblib"]


def verbs(command=None, name=()):
    """Every command that does something, as the words that call it."""
    command = command or typer.main.get_command(app)
    inside = getattr(command, "commands", {})
    if not inside:
        return [name]
    return [words for key, one in inside.items() for words in verbs(one, (*name, key))]


@pytest.fixture
def folder(tmp_path):
    """A folder with one good scan and one that is cut off."""
    shutil.copy(SCANS / "office.npz", tmp_path / "good.npz")
    (tmp_path / "cut.npz").write_bytes((SCANS / "office.npz").read_bytes()[:50_000])
    return tmp_path


def one_line(err: str) -> str:
    """The error, which must be one line for people and no traceback."""
    (line,) = err.splitlines()
    assert line.startswith("laserimg: ")
    assert "Traceback" not in line
    return line


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*")}


@pytest.mark.parametrize("words", verbs(), ids=" ".join)
def test_every_verb_has_help_with_an_example(words):
    done = laserimg(*words, "--help")
    assert done.code == 0
    examples = [line for line in done.out.splitlines() if line.startswith(f"    laserimg {' '.join(words)}")]
    assert examples, done.out


def test_help_lists_every_verb_with_a_line_and_is_quick(capsys):
    command = [sys.executable, "-m", "laserimg", "--help"]
    begin = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    with capsys.disabled():
        print(f"\nlaserimg --help: {1000 * (time.perf_counter() - begin):.0f} ms")
    for words in verbs():
        assert f"\n  {words[0]} " in done.stdout


def test_help_loads_nothing_heavy():
    script = f"import sys, laserimg.cli.app; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_version():
    assert laserimg("--version") == (0, f"{package.__version__}\n", "")


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["detect"],
        ["detect", "good.npz"],
        ["detect", "good.npz", "-o", "out", "--nonsense"],
        ["detect", "good.npz", "-o", "out", "--jobs", "0"],
        ["detect", "good.npz", "-o", "out", "--partition", "nonsense"],
        ["detect", "good.npz", "-o", "out", "--from", "nonsense"],
        ["detect", "good.npz", "-o", "out", "--rejected", "nonsense"],
        ["show"],
        ["show", ".", "--no-open"],
        ["show", "good.npz", "--image", "nonsense"],
        ["show", "good.npz", "-o", "good.jpg"],
        ["images", "good.npz", "-o", "out", "--kinds", "nonsense"],
        ["convert", "good.npz", "-o", "good.nonsense"],
        ["rules", "set", "wastebasket.height"],
        ["card", "good.npz"],
    ],
    ids=" ".join,
)
def test_wrong_usage_exits_with_2_and_does_nothing(folder, arguments):
    before = names(folder)
    done = laserimg(*arguments, folder=folder)
    assert done.code == 2
    assert done.out == ""
    assert "Error: " in done.err
    assert names(folder) == before


@pytest.mark.parametrize("name, reason", [("missing.npz", "no such file"), ("cut.npz", "not an NPZ file")])
@pytest.mark.parametrize(
    "arguments",
    [
        ["detect", "NAME", "-o", "out", "--quiet"],
        ["show", "NAME", "--no-open", "-o", "out.png"],
        ["info", "NAME"],
        ["images", "NAME", "-o", "out"],
        ["convert", "NAME", "-o", "out.npz"],
    ],
    ids=lambda words: words[0],
)
def test_input_that_fails_exits_with_1_and_one_line(folder, arguments, name, reason):
    done = laserimg(*[name if word == "NAME" else word for word in arguments], folder=folder)
    assert done.code == 1
    line = one_line(done.err)
    assert name in line
    assert reason in line
    assert done.out == ""
    assert not list(folder.rglob("out.*"))
    assert not list(folder.rglob("*.png"))


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["detect", "good.npz", "-o", "out", "--rules", "missing.toml"], "missing.toml"),
        (["detect", "good.npz", "-o", "out", "--candidates", "missing.json"], "missing.json"),
        (["detect", "good.npz", "-o", "out", "--cascades", "missing"], "missing: no such"),
        (["detect", "good.npz", "-o", "cut.npz"], "cut.npz"),
        (["demo", "-o", "cut.npz"], "cut.npz"),
        (["show", "good.npz", "--no-open", "-o", "cut.npz/a.png"], "cut.npz"),
        (["show", "good.npz", "--no-open", "--scan", "3"], "good.npz: has no scan 3"),
        (
            ["show", "good.npz", "--no-open", "--image", "reflectance"],
            "good.npz: the scan has no reflectance",
        ),
        (["convert", "good.npz", "-o", "cut.npz/a.npz"], "cut.npz"),
        (["rules", "show", "missing.toml"], "missing.toml"),
        (["evaluate", "missing.json", "missing.json"], "missing.json"),
        (["train", "cascade", "--positives", "missing", "--negatives", ".", "-o", "out"], "missing"),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, list) else "",
)
def test_what_else_can_be_missing_or_in_the_way_is_named_in_one_line(folder, arguments, words):
    before = names(folder)
    done = laserimg(*arguments, folder=folder)
    assert done.code == 1
    assert words in one_line(done.err)
    assert names(folder) == before


def test_one_bad_scan_never_stops_the_others(folder):
    done = laserimg("detect", folder, "-o", "out", folder=folder)
    assert done.code == 1
    assert "cut.npz: not an NPZ file" in one_line(done.err)
    assert "good.npz" in done.out
    found = json.loads((folder / "out" / "detections.json").read_text(encoding="utf-8"))
    assert [image["file_name"] for image in found["images"]] == ["good.npz"]
    errors = json.loads((folder / "out" / "errors.json").read_text(encoding="utf-8"))
    assert [entry["file_name"] for entry in errors] == ["cut.npz"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["demo", "--json"],
        ["detect", "good.npz", "-o", "out", "--json"],
        ["info", "good.npz", "--json"],
        ["rules", "show", "--json"],
    ],
    ids=" ".join,
)
def test_json_is_all_that_is_printed(folder, arguments):
    done = laserimg(*arguments, folder=folder)
    assert (done.code, done.err) == (0, "")
    assert json.loads(done.out)


@pytest.mark.parametrize(
    "arguments",
    [
        ["demo"],
        ["detect", "good.npz", "-o", "out"],
        ["show", "good.npz", "--no-open", "-o", "good.png"],
        ["info", "good.npz"],
        ["images", "good.npz", "-o", "out"],
        ["convert", "good.npz", "-o", "good.ptx"],
        ["rules", "set", "wastebasket.height.max", "0.5"],
        ["rules", "validate", "rules.toml"],
    ],
    ids=" ".join,
)
def test_quiet_prints_nothing(folder, arguments):
    (folder / "rules.toml").write_text('format = 1\n[wastebasket]\nfrom = ["regions"]\n', encoding="utf-8")
    assert laserimg(*arguments, "--quiet", folder=folder) == (0, "", "")


def test_what_cannot_be_leaves_earlier_results_as_they_are(tmp_path):
    scan = SCANS / "office.npz"
    assert laserimg("detect", scan, "-o", tmp_path / "out", "--cascades", "none", "--quiet").code == 0
    before = (tmp_path / "out" / "detections.json").read_bytes()
    (tmp_path / "empty").mkdir()
    for wrong, message in (
        ((scan, "--up", "sideways"), "up must be x, y, z"),
        ((tmp_path / "typo.npz",), "typo.npz: no such file or folder"),
        ((tmp_path / "typo",), "typo: no such file or folder"),
        ((scan, "--min-range", "5", "--max-range", "2"), "0 <= min < max"),
        ((scan, "--cascades", tmp_path / "empty"), "no detectors in it; --cascades none"),
    ):
        done = laserimg("detect", *wrong, "-o", tmp_path / "out")
        assert done.code != 0 and message in " ".join(done.err.split())
        assert (tmp_path / "out" / "detections.json").read_bytes() == before
        assert laserimg("detect", *wrong, "-o", tmp_path / "new").code == done.code
        assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("train", "cascade", "--image", "foo"), "known: range, reflectance"),
        (("train", "cascade", "--target", "nan"), "target must be at least 0"),
        (("train", "cascade", "--target", "-1"), "target must be at least 0"),
    ],
)
def test_wrong_options_of_a_training_end_it_before_it_begins(words, message, tmp_path):
    (tmp_path / "crops").mkdir()
    done = laserimg(*words, "--positives", "crops", "--negatives", "crops", "-o", "out", folder=tmp_path)
    assert done.code == 2 and message in " ".join(done.err.replace("│", " ").split())
    assert not (tmp_path / "out").exists()


def test_a_folder_without_objects_says_so(tmp_path):
    (tmp_path / "empty").mkdir()
    recipe = Recipe("honv")
    zeros = np.zeros((2, recipe.length), np.float32)
    save_model(tmp_path / "m.npz", ObjectModel(("a", "b"), zeros, zeros[:, 0], recipe))
    done = laserimg("classify", "predict", tmp_path / "m.npz", tmp_path / "empty")
    assert (done.code, done.out) == (1, "") and "empty: no objects" in done.err


def test_broken_files_in_a_folder_are_named(tmp_path):
    """Those that are read before it is known whether they are scans too."""
    shutil.copy(SCANS / "office.npz", tmp_path)
    (tmp_path / "cut.dat.bz2").write_bytes(b"BZh9")
    (tmp_path / "empty.feather").write_bytes(b"")
    (tmp_path / "notes.txt").write_text("Not a scan.")
    done = laserimg("info", tmp_path)
    assert done.code == 1 and "office.npz" in done.out
    assert [name in done.err for name in ("cut.dat.bz2", "empty.feather", "notes.txt")] == [True, True, False]
