"""What an installed laserimg carries, in a wheel (as `pip install .` makes) and in an editable install."""

from importlib.metadata import distribution
from pathlib import Path

import pytest

import laserimg
from laserimg.detectors.shipped import detector_files, shipped_folder
from laserimg.rules.file import SHIPPED

PACKAGE = Path(laserimg.__file__).parent


@pytest.mark.parametrize("name", ["py.typed", "rules/default.toml", "demo/office.npz", "demo/street.npz"])
def test_the_package_carries_its_data(name):
    assert (PACKAGE / name).is_file()


def test_the_shipped_rules_are_those_of_the_package():
    assert SHIPPED == PACKAGE / "rules" / "default.toml"


def test_the_folder_of_shipped_detectors_is_there_in_this_install():
    assert shipped_folder().name == "cascades"
    assert shipped_folder().is_dir()
    assert isinstance(detector_files(shipped_folder()), list)


@pytest.mark.parametrize("place", ["laserimg/cascades", "cascades"], ids=["wheel", "editable"])
def test_shipped_detectors_are_found_in_either_layout(tmp_path, monkeypatch, place):
    (tmp_path / "laserimg").mkdir()
    (tmp_path / place).mkdir()
    monkeypatch.setattr(laserimg, "__file__", str(tmp_path / "laserimg" / "__init__.py"))
    assert shipped_folder() == tmp_path / place


def test_inside_a_wheel_the_package_comes_first(tmp_path, monkeypatch):
    """A folder called cascades in site-packages is somebody else's."""
    for place in ("laserimg/cascades", "cascades"):
        (tmp_path / place).mkdir(parents=True)
    monkeypatch.setattr(laserimg, "__file__", str(tmp_path / "laserimg" / "__init__.py"))
    assert shipped_folder() == tmp_path / "laserimg" / "cascades"


def test_one_version_and_one_script():
    installed = distribution("laserimg")
    assert installed.version == laserimg.__version__
    scripts = [entry.value for entry in installed.entry_points if entry.group == "console_scripts"]
    assert scripts == ["laserimg.cli:main"]


def test_the_door_opens_on_every_public_name():
    for name in laserimg.__all__:
        assert getattr(laserimg, name) is not None
    assert set(laserimg.__all__) <= set(dir(laserimg))
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = laserimg.nonsense
