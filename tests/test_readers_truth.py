"""Every format against the decoded truth of a real file."""

import numpy as np

from laserimg.readers import open_scans


def only(path):
    (scan,) = open_scans(path)
    return scan


def test_office_is_recovered_exactly(data):
    scan = only(data("office_room/room_scan1.pcd"))
    truth = np.load(data("office_room/room_scan1_grid.npz"))
    expected = np.nan_to_num(truth["range_first"])
    np.testing.assert_array_equal(scan.range, expected)
    assert scan.wraps
    assert scan.min_range == 0.5
    np.testing.assert_allclose(scan.points()[90], truth["xyz"][90], atol=2e-2)


def test_ptx_stands_upright_and_loses_nothing(data):
    scan = only(data("leica_ptx/1.ptx"))
    truth = np.load(data("leica_ptx/leica_ptx_cars_91x199.npz"))
    assert scan.shape == (91, 199)
    assert not scan.wraps
    np.testing.assert_array_equal(scan.range > 0, truth["range"] > 0)
    np.testing.assert_allclose(scan.points(), truth["xyz"], atol=1e-5)
    np.testing.assert_array_equal(scan.reflectance[scan.range > 0], truth["intensity"][scan.range > 0])
    assert round(float((scan.range == 0).mean()), 3) == 0.053
