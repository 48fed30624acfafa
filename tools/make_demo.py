"""The scans that ship for `laserimg demo`: an office and a street of simulated objects at chosen places.

    python tools/make_demo.py                      # writes laserimg/demo/*.npz
    python tools/make_demo.py -o somewhere

The same command writes the same bytes again on the same machine. It needs the extra `simulate`.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Scan
from laserimg.simulate.footprint import Beam
from laserimg.simulate.measure import simulated
from laserimg.simulate.mesh import pose_at
from laserimg.simulate.objects import OBJECTS
from laserimg.simulate.objects.facades import front
from laserimg.simulate.receiver import Receiver
from laserimg.simulate.scanner import Scanner
from laserimg.simulate.scanner.model import Intensity, Noise
from laserimg.simulate.scanner.spinning import full_turn
from laserimg.simulate.scenes.grounds import Street, street_ground
from laserimg.simulate.scenes.rooms import BLANK, INSIDE, OUTSIDE, room
from laserimg.simulate.things import Scene, Thing

FOLDER = Path(__file__).parents[1] / "laserimg" / "demo"

# Elevations in degrees and columns of a 2D laser that scans upright lines while its head turns once round.
OFFICE_GRID = (np.linspace(45.0, -55.0, 201, dtype=np.float32), 720)
STREET_GRID = (np.linspace(20.0, -40.0, 168, dtype=np.float32), 1000)

# Kind, which one of that kind, x and y in metres, and where its front looks, in degrees.
Place = tuple[str, int, float, float, float]
ROOM_M = (7.0, 5.5, 2.7)
IN_OFFICE: tuple[Place, ...] = (
    ("desk", 3, 2.2, 4.9, -90), ("desk", 2, 4.5, 4.9, -90), ("desk", 3, 6.4, 2.2, 180),
    ("office_chair", 4, 2.4, 3.9, 70), ("office_chair", 5, 4.3, 4.0, 120), ("office_chair", 6, 5.6, 2.0, -20),
    ("wastebasket", 6, 5.0, 3.2, 0), ("drum", 2, 0.8, 1.2, 0), ("cardboard_boxes", 1, 3.6, 0.8, 20),
    ("shelf", 10, 0.3, 3.9, 0), ("shelf", 11, 5.1, 0.3, 90), ("cabinet", 12, 0.4, 2.5, 0),
)  # fmt: skip
ROAD = Street(5.2, 3.0, 0.0, 0.12, 0.0, 1.5, (False, False), False)
HOUSES = ((-10, 9.0, -90), (2, 9.0, -90), (14, 9.0, -90), (-8, -9.0, 90), (6, -9.0, 90))
IN_STREET: tuple[Place, ...] = (
    ("car", 6, 3.0, 4.0, 2), ("car", 28, -4.0, -4.0, 183), ("lorry", 6, -10.5, 4.0, 0),
    ("person", 3, 1.2, -6.4, 40), ("person", 8, 7.0, -1.0, 100), ("litter_bin", 6, -0.8, -6.0, 90),
    ("lamp_post", 1, -0.9, 6.0, -90), ("sign_post", 2, 4.0, -5.7, 0),
    ("tree", 4, -8.0, -6.5, 0), ("tree", 6, 12.0, -6.3, 0),
)  # fmt: skip


def office() -> Scene:
    """Return an office: desks, chairs, shelves, a drum, boxes, one wastebasket, a door, two windows."""
    walls = room(np.random.default_rng(3), ROOM_M, (INSIDE, BLANK, BLANK, OUTSIDE))
    things = [sample(kind, number).at(x, y, 0, yaw) for kind, number, x, y, yaw in IN_OFFICE]
    return Scene((*walls.things, *things), (pose_at(3.5, 2.75, 1.1),), "office")


def street() -> Scene:
    """Return a street: two cars, a van, houses, a litter bin, poles, trees and two people."""
    rng = np.random.default_rng(5)
    things = [part.at(x, y, 0, yaw) for x, y, yaw in HOUSES for part in front(rng, 12.0)]
    things += [
        sample(kind, number).at(x, y, ROAD.height_m(x, y), yaw) for kind, number, x, y, yaw in IN_STREET
    ]
    return Scene((street_ground(rng, ROAD), *things), (pose_at(0, 0, 1.7),), "street")


def sample(kind: str, number: int) -> Thing:
    """Return one of the objects of a kind: every number is another."""
    return OBJECTS[kind](np.random.default_rng(number))


def scanner(elevation_deg: NDArray[np.float32], columns: int) -> Scanner:
    """Return a scanner with a narrow beam; its ranges, whole steps of 1/1024 m, compress."""
    return Scanner(
        "demo",
        full_turn(elevation_deg, columns),
        wraps=True,
        step_m=1 / 1024,
        min_range_m=0.5,
        max_range_m=50.0,
        beam=Beam(0.008, 0.004),
        receiver=Receiver(reach_m=18.0, pulse_m=1.2, strongest=False),
        noise=Noise(white_m=0.008, weakest_m=0.02, ring_m=0.0, ring_period_m=1.0, power=0.05),
        intensity=Intensity(made_up=0.0, exponent=0.25, scale=200, top=254),
    )


def arrays_of(scan: Scan, elevation_deg: NDArray[np.float32], columns: int) -> dict[str, NDArray]:
    """Return what the file of a scan holds: angles in place of directions."""
    assert scan.reflectance is not None
    return {
        "range": scan.range,
        "reflectance": scan.reflectance.astype(np.uint8),
        "azimuth_deg": (180 - 360 * (np.arange(columns) + 0.5) / columns).astype(np.float32),
        "elevation_deg": elevation_deg,
        "wraps": np.array(True),
    }


def demo_scans() -> dict[str, dict[str, NDArray]]:
    """Return the arrays of each demo scan, by the name of its file."""
    office_scan = simulated(office(), 0, scanner(*OFFICE_GRID), seed=1).scan
    street_scan = simulated(street(), 0, scanner(*STREET_GRID), seed=2).scan
    scans = {
        "office": arrays_of(office_scan, *OFFICE_GRID),
        "street": arrays_of(street_scan, *STREET_GRID),
    }
    del scans["office"]["reflectance"]  # many turning 2D lasers give none
    return scans


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
