"""Clusters that are objects: people who touch, cars with beams missing, facades."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from laserimg.errors import ConfigError, ScanError
from laserimg.formats.boxes3d import labels_beside
from laserimg.ground import ground_of_points
from laserimg.object_clusters import object_clusters
from laserimg.rbnn import rbnn
from laserimg.readers import read_file

SCANNER_M = 1.7


def upright(x, y, width=0.4, low=0.25, high=1.75, step=0.05):
    """A board of points facing the scanner: (n, 3) with the height over the ground as z."""
    across, up = np.meshgrid(np.arange(-width / 2, width / 2 + 1e-9, step), np.arange(low, high, step))
    return np.stack([np.full(across.size, x), y + across.ravel(), up.ravel()], axis=-1)


def clusters(*things, **options):
    """Labels of each thing, one array each."""
    points = np.concatenate(things)
    height = points[:, 2].copy()
    labels = object_clusters(points - [0, 0, SCANNER_M], height, **options)
    return np.split(labels, np.cumsum([len(thing) for thing in things])[:-1])


def the_only(labels):
    assert len(set(labels.tolist())) == 1
    return int(labels[0])


def hand(x, y, other, z=1.1):
    """Two returns in a gap, so that no step is wider than the radius of the links."""
    return np.array([[x, at, z] for at in np.linspace(y, other, 4)[1:-1]])


def test_two_people_who_touch():
    one, other = upright(10, 0), upright(10, 0.8)
    between = hand(10, 0.2, 0.6)
    points = np.concatenate([one, other, between]) - [0, 0, SCANNER_M]
    assert rbnn(points).max() == 1
    first, second, held = clusters(one, other, between)
    assert the_only(first) != the_only(second)
    assert set(held) <= {first[0], second[0]}


def test_a_person_before_a_facade():
    person, facade = upright(11.6, 0), upright(12, 0, width=8, high=7, step=0.1)
    assert rbnn(np.concatenate([person, facade]) - [0, 0, SCANNER_M]).max() == 1
    first, second = clusters(person, facade)
    assert the_only(first) != the_only(second)


def test_a_car_that_beams_miss_is_one():
    rings = [upright(5, 0, width=4, low=z, high=z + 0.01) for z in (0.3, 0.65, 1.0, 1.35)]
    assert rbnn(np.concatenate(rings) - [0, 0, SCANNER_M]).max() == 4
    labels = np.concatenate(clusters(*rings))
    assert the_only(labels) == 1


def test_what_is_taller_than_people_and_cars_stays_together():
    """Two halves of a facade, 0.6 m apart: not cut. Two people, the same: cut."""
    for high, count in ((6.0, 1), (1.8, 2)):
        halves = upright(12, 0, 1.5, high=high), upright(12, 2.1, 1.5, high=high)
        labels = np.concatenate(clusters(*halves, hand(12, 0.75, 1.35)))
        assert labels.max() == count


def test_low_pieces_are_no_objects():
    """A bicycle beside its rider: 0.5 m high, so not cut off."""
    rider, wheel = upright(10, 0), upright(10, 0.7, 0.6, high=0.7)
    labels = np.concatenate(clusters(rider, wheel))
    assert the_only(labels) == 1


def test_a_roof_that_no_beam_joins_to_the_car_is_part_of_it():
    """0.35 m behind the bonnet at 6 m, where the radius is 0.2 m; a person's shoulders there are not."""
    car = upright(6, 0, width=1.7, low=0.25, high=0.9)
    for width, part in ((1.4, True), (0.5, False)):
        roof = upright(6.35, 0, width=width, low=1.3, high=1.45, step=0.04)
        below, above = clusters(car, roof)
        assert (the_only(below) == the_only(above)) == part


def test_a_roof_does_not_join_a_hedge():
    hedge, roof = upright(6, 0, width=8, low=0.25, high=0.9), upright(6.35, 0, 1.4, 1.3, 1.45, 0.04)
    first, second = clusters(hedge, roof)
    assert the_only(first) != the_only(second)


def test_a_car_is_not_cut_at_its_doors():
    """Halves 6 cm apart at 5 m, where a quarter of the radius is 4 cm; narrow halves (people) are cut."""
    for width, count in ((2.2, 1), (0.6, 2)):
        halves = [upright(5, side * (width / 2 + 0.03), width, step=0.03) for side in (-1, 1)]
        assert np.concatenate(clusters(*halves)).max() == count


def test_a_car_before_something_long_and_low_is_cut_off():
    """A guard rail of 14 m, too low to be an object, 0.9 m behind a car at 30 m."""
    car, rail = upright(30, 0, 4, step=0.1), upright(30.9, 0, 14, low=0.3, high=0.6, step=0.1)
    assert rbnn(np.concatenate([car, rail]) - [0, 0, SCANNER_M]).max() == 1
    first, second = clusters(car, rail)
    assert the_only(first) not in set(second.tolist())


def test_up_may_be_any_direction():
    one, other = upright(10, 0), upright(10, 0.8)
    points = np.concatenate([one, other, hand(10, 0.2, 0.6)])
    height = points[:, 2].copy()
    points[:, 2] -= SCANNER_M
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    assert_array_equal(
        object_clusters(points, height), object_clusters(points @ turn.T, height, up=turn[:, 2])
    )


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_the_order_of_the_points_does_not_matter(seed):
    random = np.random.default_rng(seed)
    things = [upright(x, y) for x, y in random.uniform((6, -3), (14, 3), (12, 2))]
    points = np.concatenate(things) + 0.01 * random.normal(size=(sum(map(len, things)), 3))
    height = points[:, 2].copy()
    points[:, 2] -= SCANNER_M
    order = random.permutation(len(points))
    one, other = object_clusters(points, height), object_clusters(points[order], height[order])
    pairs = set(zip(one[order].tolist(), other.tolist(), strict=True))
    assert len(pairs) == len(set(one.tolist())) == len(set(other.tolist()))
    assert one.max() == len(set(one.tolist()) - {0})


def test_nothing_and_noise():
    assert object_clusters(np.zeros((0, 3)), []).tolist() == []
    assert object_clusters([[np.nan, 0, 0], [0, 0, 0], [5, 0, 0]], [0, 0, 1]).tolist() == [0, 0, 0]
    assert clusters(upright(10, 0), min_points=10_000)[0].max() == 0


def test_wrong_input():
    with pytest.raises(
        ScanError, match=r"points must be \(n, 3\) and heights \(n,\), got \(4, 3\) and \(3,\)"
    ):
        object_clusters(np.ones((4, 3)), np.ones(3))
    with pytest.raises(ConfigError, match="ratio must be"):
        object_clusters(np.ones((4, 3)), np.ones(4), ratio=2)
    with pytest.raises(ConfigError, match="ratio must be"):
        object_clusters(np.ones((4, 3)), np.ones(4), ratio=0.0002)


# --- real scans


def is_one_cluster(labels, points, box):
    """At least 80 % of the object in the cluster, and of the cluster in the object's box."""
    own = labels[box.holds(points, 0.05)]
    cluster = int(np.bincount(own).argmax())
    inside = box.holds(points[labels == cluster], 0.2)
    return cluster > 0 and (own == cluster).mean() >= 0.8 and inside.mean() >= 0.8


def test_labelled_people_are_clusters_of_their_own(data):
    found = {"rbnn": [], "objects": []}
    for file in sorted(data("sustech/data/example/lidar").glob("*.pcd")):
        (scan,) = read_file(file)
        points = scan.points()[scan.valid & (scan.range > 0.5)].astype(float)
        ground = ground_of_points(points)
        points, height = points[~ground.mask], ground.height[~ground.mask]
        people = [box for box in labels_beside(file).boxes if box.kind in ("pedestrian", "rider")]
        people = [box for box in people if box.holds(points, 0.05).sum() >= 50]
        for way, labels in (("rbnn", rbnn(points)), ("objects", object_clusters(points, height))):
            found[way] += [is_one_cluster(labels, points, box) for box in people]
    assert len(found["rbnn"]) == 20
    assert sum(found["objects"]) >= 18 > 13 >= sum(found["rbnn"])


def test_columns_of_a_post_are_no_objects():
    """A round post of 1 m: where it turns away its columns are farther apart than the smallest radii."""
    turn = np.radians(np.arange(-80, 81, 8.0))
    x, y = 5 - 0.5 * np.cos(turn), 0.5 * np.sin(turn)
    z = np.arange(0.25, 2.2, 0.04)
    points = np.stack([np.repeat(x, len(z)), np.repeat(y, len(z)), np.tile(z, len(x)) - 1.5], axis=-1)
    height = points[:, 2] + 1.5
    assert object_clusters(points, height).max() == 1


def test_columns_that_are_coarser_than_a_cut_stay_together_with_the_pitch_and_not_without():
    """Two people 0.25 m apart at 10 m, columns 15 cm apart: cuts below the pitch would free each column."""
    y = np.concatenate([np.arange(5) * 0.15, 0.85 + np.arange(5) * 0.15])
    z = np.arange(0.25, 1.8, 0.04)
    columns = np.stack([np.repeat(y, len(z)), np.tile(z, len(y)) - 1.5], axis=-1)
    # Two rows deep, so that a column is 0.12 m across.
    points = np.concatenate(
        [np.column_stack([np.full(len(columns), depth), columns]) for depth in (10, 10.12)]
    )
    height = points[:, 2] + 1.5
    assert object_clusters(points, height, pitch=0.015).max() == 2
    assert object_clusters(points, height).max() > 2
