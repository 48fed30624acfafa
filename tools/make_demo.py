"""The scans that ship for `laserimg demo`, made by casting rays into two small scenes.

    python tools/make_demo.py                      # writes laserimg/demo/*.npz
    python tools/make_demo.py -o somewhere

The same command writes the same bytes again.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.projection import directions_from_angles
from objects import (
    Thing,
    car,
    chair,
    crate,
    drum,
    facade,
    hall,
    person,
    pole,
    shelf,
    table,
    terrain,
    tree,
    wastebasket,
)
from scenes import Scene, scan_of
from shapes import Frustum, Part, box, pose

FOLDER = Path(__file__).parents[1] / "laserimg" / "demo"

# Ranges are stored in steps of 1/1024 m: as fine as the millimetres that scanners give, and the
# zero bits at the end compress.
STEP_M = 1 / 1024

# Returns are lost at random, and where the beam only grazes a surface.
LOST = 0.004
MIN_COSINE = 0.04

# A beam at an edge sees both surfaces; this share of them gives a range between the two.
MIXED = 0.3
EDGE_M = 0.1


def office() -> Scene:
    """Return an office: desks, chairs, shelves, a drum, boxes, and one wastebasket."""
    desks = [
        table(1.6, 0.8, 0.74).at(-1.2, 2.25),
        table(1.6, 0.8, 0.74).at(0.9, 2.25),
        table(1.4, 0.8, 0.74).at(2.95, -0.6, yaw=90),
    ]
    screens = [
        monitor().at(-1.2, 2.4, 0.74, yaw=-90),
        monitor().at(0.9, 2.4, 0.74, yaw=-80),
        monitor().at(3.1, -0.5, 0.74, yaw=170),
    ]
    chairs = [
        chair().at(-1.0, 1.45, yaw=70),
        chair().at(0.75, 1.4, yaw=120),
        chair().at(2.2, -0.8, yaw=-20),
    ]
    others = [
        wastebasket().at(1.55, 0.45),
        drum().at(-2.6, -1.6),
        crate(0.60, 0.40, 0.45, 0.45).at(0.2, -1.9, yaw=20),
        crate(0.45, 0.45, 0.12, 0.5).at(-1.2, -1.5, yaw=35),
        shelf().at(-3.2, 1.1),
        shelf(1.2, 0.4, 2.0).at(1.6, -2.45, yaw=90),
        cupboard().at(-3.15, -0.3),
        window(1.6, 1.2).at(-1.0, 2.74, 0.95),
        window(1.6, 1.2).at(1.2, 2.74, 0.95),
    ]
    return Scene((hall(7, 5.5, 2.7), *desks, *screens, *chairs, *others), (0.0, 0.0, 1.1), 20.0)


def street() -> Scene:
    """Return a street: two cars, a van, walls, houses, a litter bin, a pole, trees and two people."""
    rng = np.random.default_rng(5)
    houses = [facade(14, 6.5, 5).at(x, 11.0, yaw=-90) for x in (-9, 6, 21)]
    houses += [facade(12, 8, 4, 3).at(x, -12.0, yaw=90) for x in (-8, 14)]
    vehicles = [
        car().at(3.0, 5.0, yaw=2),
        car(4.0, 1.7, 1.5, 0.35).at(-4.0, -4.6, yaw=183),
        van().at(-10.0, 2.6, yaw=-4),
    ]
    people = [person(1.78).at(1.2, -4.2, yaw=40), person(1.65).at(8.0, 1.0, yaw=100)]
    others = [
        crate(6.5, 0.3, 1.1, 0.45).at(7.0, -6.2),
        litter_bin().at(-0.4, -5.9),
        crate(0.6, 1.4, 1.25, 0.4).at(9.0, 5.4, yaw=5),
        pole().at(-0.9, 6.6),
        pole(3.0, 0.08).at(2.9, -6.0),
        tree(rng, 6.0).at(-9.0, -7.5),
        tree(rng, 5.0, 2.6).at(13.0, -8.0),
    ]
    return Scene((terrain(), *houses, *vehicles, *people, *others), (0.0, 0.0, 1.7), 60.0)


def monitor() -> Thing:
    """Return a computer screen on its foot, facing x."""
    foot = Part(box(0.2, 0.24, 0.02), reflectance=0.2)
    stem = Part(box(0.04, 0.06, 0.12), pose(x=-0.03), 0.2)
    screen = Part(box(0.04, 0.54, 0.34), pose(z=0.1), 0.15)
    return Thing("monitor", (foot, stem, screen))


def cupboard() -> Thing:
    """Return a closed cupboard with its front along x."""
    return Thing("cupboard", (Part(box(0.45, 0.9, 1.2), reflectance=0.6),))


def window(width: float, height: float) -> Thing:
    """Return a pane in a wall, which gives no return."""
    return Thing("window", (Part(box(width, 0.02, height), reflectance=0.0),))


def litter_bin() -> Thing:
    """Return the litter bin of a street, round on a foot."""
    foot = Part(Frustum(0.1, 0.1, 0.25), reflectance=0.3)
    return Thing("litter bin", (foot, Part(Frustum(0.22, 0.22, 0.65), pose(z=0.25), 0.3)))


def van(length: float = 5.2, width: float = 2.0, height: float = 2.55) -> Thing:
    """Return a delivery van: a tall box, a short bonnet, four wheels."""
    load = Part(box(length - 0.9, width, height - 0.3), pose(x=-0.45, z=0.3), 0.75)
    bonnet = Part(box(0.9, width, 0.9), pose(x=length / 2 - 0.45, z=0.3), 0.75)
    at = [(x, y) for x in (-length / 2 + 0.9, length / 2 - 0.8) for y in (-width / 2 + 0.1, width / 2 - 0.1)]
    wheels = [Part(box(0.62, 0.2, 0.62), pose(x, y), 0.1) for x, y in at]
    return Thing("van", (load, bonnet, *wheels))


def turntable(rows: int, columns: int, top_deg: float, bottom_deg: float) -> dict[str, NDArray[np.float32]]:
    """Return the angles of a 2D laser that scans upright lines while its head turns once round."""
    step = 360 / columns
    return {
        "azimuth_deg": (180 - step * (np.arange(columns) + 0.5)).astype(np.float32),
        "elevation_deg": np.linspace(top_deg, bottom_deg, rows, dtype=np.float32),
    }


def measure(scene: Scene, angles: dict[str, NDArray[np.float32]], seed: int) -> dict[str, NDArray]:
    """Return range and reflectance as a scanner gives them: 1 cm noise, lost returns, mixed pixels."""
    rays = directions_from_angles(np.radians(angles["azimuth_deg"]), np.radians(angles["elevation_deg"]))
    scan, truth = scan_of(scene, rays, noise=0.0, seed=seed)
    rng = np.random.default_rng(seed)
    range_m = mixed(truth.range, rng) + rng.normal(0, 0.01, rays.shape[:2])
    cosine = -np.einsum("ijk,ijk->ij", truth.normals, rays)
    lost = (truth.range == 0) | (cosine < MIN_COSINE) | (rng.random(rays.shape[:2]) < LOST)
    reflectance = np.zeros(rays.shape[:2]) if scan.reflectance is None else scan.reflectance
    speckle = rng.normal(1, 0.05, rays.shape[:2])
    return {
        "range": np.where(lost, 0, np.round(range_m / STEP_M) * STEP_M).astype(np.float32),
        "reflectance": np.where(lost, 0, np.clip(255 * reflectance * speckle, 1, 255)).astype(np.uint8),
    }


def mixed(range_m: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the ranges with some of those beside an edge in a row drawn towards the neighbour's."""
    neighbour = np.roll(range_m, 1, axis=1)
    edge = (np.abs(range_m - neighbour) > EDGE_M) & (range_m > 0) & (neighbour > 0)
    edge &= rng.random(range_m.shape) < MIXED
    share = rng.random(range_m.shape)
    return np.where(edge, share * range_m + (1 - share) * neighbour, range_m)


def demo_scans() -> dict[str, dict[str, NDArray]]:
    """Return the arrays of each demo scan, by the name of its file."""
    upright = turntable(201, 720, 45.0, -55.0)
    office_scan = {**measure(office(), upright, seed=1), **upright}
    del office_scan["reflectance"]  # many turning 2D lasers give none
    around = turntable(168, 1000, 20.0, -40.0)
    street_scan = {**measure(street(), around, seed=2), **around}
    return {
        name: {**arrays, "wraps": np.array(True)}
        for name, arrays in (("office", office_scan), ("street", street_scan))
    }


def main() -> None:
    """Write the demo scans."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--out", type=Path, default=FOLDER, help="default: laserimg/demo")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    for name, arrays in demo_scans().items():
        path = out / f"{name}.npz"
        np.savez_compressed(path, **arrays)  # type: ignore[arg-type]  # numpy's stub takes the names for options
        rows, columns = arrays["range"].shape
        print(f"{path}: {rows} x {columns}, {path.stat().st_size / 1024:.0f} KB")


if __name__ == "__main__":
    main()
