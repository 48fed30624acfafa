"""What the README and the docstrings say is run: commands, Python, rules, formats, folders."""

import contextlib
import doctest
import io
import pkgutil
import re
import shlex
import shutil
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import laserimg as package
from command import laserimg
from laserimg.detectors.shipped import shipped_folder
from laserimg.images import write_png
from laserimg.readers import suffixes
from laserimg.rules.file import SHIPPED, parse_rules

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
MODULES = [module.name for module in pkgutil.walk_packages(package.__path__, "laserimg.")]


def blocks(language: str) -> list[str]:
    return [text for name, text in BLOCKS if name == language]


def commands() -> list[str]:
    """The commands of the README, except the two that install: those are what .ci/run does."""
    lines = [line for text in blocks("sh") for line in text.splitlines()]
    return [line for line in lines if not line.startswith("pip install ")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the README is followed: the demo has run; the reader has crops to train on, and the truth."""
    folder = tmp_path_factory.mktemp("readme")
    laserimg("demo", "--quiet", folder=folder)
    rng = np.random.default_rng(0)
    for number in range(40):
        crop = rng.normal(60, 15, (24, 24))
        crop[4:20, 7:17] += 120
        write_png(folder / "crops" / f"{number}.png", crop.clip(0, 255).astype(np.uint8))
    shutil.copy(folder / "laserimg-demo" / "results" / "detections.json", folder / "truth.coco.json")
    return folder


@pytest.fixture(scope="module")
def followed(folder):
    """What became of each command, in the order of the README: some need the one before."""
    done = {}
    for line in commands():
        name, *arguments = shlex.split(line)
        assert name == "laserimg"
        unseen = ["--no-open"] if arguments[0] == "show" else []
        done[line] = laserimg(*arguments, *unseen, folder=folder)
    return done


def python(text: str, folder: Path) -> str:
    """Run Python in the folder; what it printed."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.chdir(folder):
        exec(compile(text, "README.md", "exec"), {})
    return out.getvalue()


def test_the_readme_has_all_its_blocks():
    """So that no block escapes the tests below through its language."""
    assert {name for name, _ in BLOCKS} == {"sh", "python", "toml", "text"}
    assert len(re.findall("^```", README, re.MULTILINE)) == 2 * len(BLOCKS)
    assert len(commands()) > 10


@pytest.mark.parametrize("what", ["pip install . && laserimg demo", 'pip install ".[test]" && pytest'])
def test_the_two_commands_are_there_as_ci_runs_them(what):
    assert README.splitlines().count(what) == 1


@pytest.mark.parametrize("line", commands())
def test_commands_run(line, followed):
    done = followed[line]
    assert (done.code, done.err) == (0, "")
    assert done.out


def test_the_class_that_the_readme_adds_is_found(folder):
    """The rules of the README make the drum of the demo office a detection."""
    changes = [shlex.split(line)[1:] for line in commands() if " drum." in line]
    for arguments in changes:
        assert laserimg(*arguments, "--file", "drum.toml", folder=folder).code == 0
    done = laserimg("detect", "laserimg-demo", "-o", "drums", "--rules", "drum.toml", folder=folder)
    assert re.search(r"office\.npz +drum .* detected", done.out)


def test_python_runs_and_finds_what_the_demo_finds(folder):
    out = python("".join(blocks("python")), folder)
    found = [line.split()[0] for line in out.splitlines() if "MetricBox(" in line]
    assert found.count("wastebasket") == 1
    assert found.count("person") >= 2
    assert re.search(r"^\w+ score 0\.[0-2]\d < 0\.35$", out, re.MULTILINE)
    count, below = out.splitlines()[-1].split()
    assert (int(count), float(below)) == (0, pytest.approx(1.2, abs=0.01))


def test_the_loop_of_the_package_docstring_runs_as_it_stands(folder):
    (folder / "cascades").mkdir()
    for file in shipped_folder().glob("wastebasket.*"):
        shutil.copy(file, folder / "cascades")
    shutil.copy(SHIPPED, folder / "rules.toml")
    laserimg("convert", "laserimg-demo/office.npz", "-o", "office.pcd", folder=folder)
    code = re.findall(r"^    (.*)$|^()$", package.__doc__ or "", re.MULTILINE)
    out = python("\n".join(line for line, _ in code), folder)
    assert "wastebasket" in out
    assert "wastebasket score 0.01 < 0.20" in out


@pytest.mark.parametrize("text", blocks("toml"))
def test_rules_are_valid(text):
    assert parse_rules(text, "README.md").labels


def test_the_table_of_formats_holds_every_suffix():
    (table,) = re.findall(r"^\| suffix .*?\n\n", README, re.MULTILINE | re.DOTALL)
    first_cells = [row.split("|")[1] for row in table.splitlines()[2:] if row]
    assert sorted(re.findall(r"`(\.\w+)`", "".join(first_cells))) == sorted(suffixes())


def test_every_folder_of_the_layout_exists():
    (layout,) = blocks("text")
    assert [line for line in layout.splitlines() if not (ROOT / line.split()[0]).exists()] == []


def test_links_and_pictures_exist():
    targets = re.findall(r"\]\(([^)#:]+)\)", README)
    assert targets
    assert [target for target in targets if not (ROOT / target).exists()] == []


@pytest.mark.parametrize("name", ["laserimg", *MODULES])
def test_examples_in_docstrings_run(name, tmp_path):
    with contextlib.chdir(tmp_path):
        assert doctest.testmod(import_module(name)).failed == 0
