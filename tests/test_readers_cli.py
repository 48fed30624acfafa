"""laserimg info and laserimg convert, as their users run them."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from laserimg.cli.app import app
from laserimg.formats.scans import write_scans
from laserimg.readers import open_scans
from laserimg.scan import Scan

RUNNER = CliRunner()


@pytest.fixture
def hall(tmp_path):
    """A panorama 1.5 m over a floor, in a hall of 5 m radius, 10 columns without return."""
    azimuth = np.pi - (np.arange(120) + 0.5) * 2 * np.pi / 120
    elevation = np.radians(np.linspace(20, -60, 41))
    with np.errstate(divide="ignore"):
        floor = np.where(elevation < 0, 1.5 / np.sin(-elevation), np.inf)
    range_m = np.repeat(np.minimum(floor, 5 / np.cos(elevation))[:, None], 120, axis=1)
    range_m[:, :10] = 0
    scan = Scan.from_range_image(range_m, azimuth, elevation, reflectance=np.full((41, 120), 7.0), wraps=True)
    return write_scans([scan], tmp_path / "hall.npz")[0]


def test_info_gives_the_figures_of_the_scan(hall):
    done = RUNNER.invoke(app, ["info", str(hall), "--json"])
    assert done.exit_code == 0
    (fact,) = json.loads(done.stdout)
    assert (fact["format"], fact["rows"], fact["columns"], fact["wraps"]) == ("npz", 41, 120, True)
    assert fact["pitch_up_deg"] == pytest.approx(2.0, abs=0.01)
    assert fact["pitch_across_deg"] == pytest.approx(3 * np.cos(np.radians(20)), abs=0.2)
    assert fact["share_of_returns"] == pytest.approx(110 / 120, abs=1e-3)
    assert fact["range_m"]["max"] == pytest.approx(5 / np.cos(np.radians(20)), abs=0.01)
    assert fact["reflectance"]["median"] == 7
    assert fact["floor"]["height_below_m"] == pytest.approx(1.5, abs=0.01)
    assert fact["floor"]["tilt_deg"] < 0.1


def test_info_prints_a_table(hall):
    done = RUNNER.invoke(app, ["info", str(hall)])
    assert "41 x 120 360" in done.stdout
    assert "1.50 m" in done.stdout


def test_info_names_what_it_cannot_read_and_shows_the_rest(hall, tmp_path):
    (tmp_path / "broken.ptx").write_text("no scan")
    done = RUNNER.invoke(app, ["info", str(tmp_path), str(tmp_path / "missing.pcd")])
    assert done.exit_code == 1
    assert "hall.npz" in done.stdout
    assert "broken.ptx: not a PTX file" in done.stderr
    assert "missing.pcd: no such file" in done.stderr


def test_convert_writes_the_same_scan(hall, tmp_path):
    target = tmp_path / "hall.pcd"
    done = RUNNER.invoke(app, ["convert", str(hall), "-o", str(target)])
    assert (done.exit_code, done.stdout.strip()) == (0, str(target))
    (before,), (after,) = open_scans(hall), open_scans(target)
    np.testing.assert_allclose(after.points(), before.points(), atol=1e-5)


def test_convert_to_an_unknown_format_is_wrong_usage(hall, tmp_path):
    done = RUNNER.invoke(app, ["convert", str(hall), "-o", str(tmp_path / "hall.las")])
    assert done.exit_code == 2
    assert "known formats: .npz .ptx .pcd .png" in done.stderr
