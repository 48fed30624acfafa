"""Objects of simulated scans: clusters of our own segmentation, labelled by what their points hit."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from laserimg.classify import ObjectImages, crop_of_pixels
from laserimg.ground import ground_of_points
from laserimg.rbnn import rbnn
from laserimg.scan import Scan
from laserimg.simulate.measure import Simulated, simulated
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.scenes import SCENES
from laserimg.simulate.things import Scene
from paper_one.plan import CLASS_OF, PARTS, Plan

# Why a cluster is no object.
FEW, OTHER, MIXED, FRAGMENT = "too few points", "no class of the paper", "undersegmented", "fragment"


@dataclass(frozen=True, slots=True)
class Truth:
    """What the points of a cluster are: the class and kind of most of them, or why that is no object."""

    label: str
    kind: str
    refused: str = ""


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """An object: its truth, its crop, its points (n, 3) with z up, and where it was seen."""

    truth: Truth
    images: ObjectImages
    points: np.ndarray
    scan: str
    range_m: float


@dataclass(frozen=True, eq=False, slots=True)
class Pool:
    """The objects of a plan, how often clusters were refused by (reason, class or kind), and the scans."""

    found: list[Found]
    refused: Counter[tuple[str, str]]
    scans: int


def collected(plan: Plan) -> Pool:
    """Make scans until every class has its images.

    Raises
    ------
    SystemExit
        If a class has too few in all scans that the plan allows.
    """
    found: list[Found] = []
    refused: Counter[tuple[str, str]] = Counter()
    missing = Counter(plan.images)
    for number in range(plan.most_scans):
        for place, name in enumerate(plan.scenes, 1):
            for truth, one in objects_of_scan(plan, name, number):
                if one is None:
                    refused[truth.refused, truth.kind if truth.refused == OTHER else truth.label] += 1
                elif missing[truth.label] > 0:
                    missing[truth.label] -= 1
                    found.append(one)
            if not missing.total():
                return Pool(found, refused, number * len(plan.scenes) + place)
    lacking = ", ".join(f"{count} {label}" for label, count in missing.items() if count)
    raise SystemExit(f"seed {plan.seed}: {lacking} missing after {plan.most_scans} scans of each scene")


def objects_of_scan(plan: Plan, name: str, number: int) -> Iterator[tuple[Truth, Found | None]]:
    """Yield the truth of every cluster of a scan, with the object if it is one."""
    scene, simulation = simulated_scan(plan, name, number)
    scan, names = simulation.scan, names_of(scene)
    hit = things_measured(simulation, plan)
    seen = np.bincount(hit[hit >= 0], minlength=len(names))
    clusters = clusters_of(scan).ravel()
    order = np.argsort(clusters, kind="stable")
    for pixels in np.split(order, np.flatnonzero(np.diff(clusters[order])) + 1):
        if not clusters[pixels[0]]:
            continue
        truth = truth_of(hit[pixels], seen, names, plan)
        yield truth, None if truth.refused else found_in(scan, pixels, truth, f"{name} {number}")


def found_in(scan: Scan, pixels: np.ndarray, truth: Truth, where: str) -> Found:
    """Return the object at the given pixels."""
    range_m = scan.range.ravel()[pixels]
    points = (range_m[:, None] * scan.directions.reshape(-1, 3)[pixels]).astype(np.float64)
    upright = points @ scan.world_from_scan[:3, :3].T
    return Found(truth, crop_of_pixels(scan, pixels), upright, where, float(np.median(range_m)))


def simulated_scan(plan: Plan, name: str, number: int) -> tuple[Scene, Simulated]:
    """Return a scene and its scan, the same as ``laserimg simulate`` makes."""
    scene = SCENES[name](np.random.default_rng([plan.seed, number]))
    return scene, simulated(scene, 0, SCANNERS[plan.scanner], seed=plan.seed * 1_000_003 + number)


def clusters_of(scan: Scan) -> np.ndarray:
    """Return the cluster (H, W) of every pixel: ground removed, radially bounded nearest neighbours."""
    points = np.asarray(scan.points()[scan.valid], np.float64)
    ground = ground_of_points(points, scan.up)
    objects = np.ones(len(points), np.bool_) if ground is None else ~ground.mask
    labels = np.zeros(len(points), np.int32)
    labels[objects] = rbnn(points[objects])
    image = np.zeros(scan.shape, np.int32)
    image[scan.valid] = labels
    return image


def things_measured(simulation: Simulated, plan: Plan) -> np.ndarray:
    """Return the thing (H * W,) whose range each pixel has, -1 where that is not known.

    A beam of 15 mrad is three pixels wide: at the edge of a thing it measures a range between two things.
    """
    scan = simulation.scan
    own = scan.valid & (np.abs(scan.range - simulation.truth_range) <= plan.off_m)
    return np.where(own, simulation.thing, -1).ravel()


def names_of(scene: Scene) -> list[tuple[str, str]]:
    """Return the class in the paper, "" for none, and the kind of every thing."""
    return [(CLASS_OF.get(one.label or one.kind, ""), one.kind) for one in scene.things]


def truth_of(things: np.ndarray, seen: np.ndarray, names: list[tuple[str, str]], plan: Plan) -> Truth:
    """Return what a cluster is, by the majority of its points.

    Parameters
    ----------
    things : (n,) array of int
        The thing that each point shows, -1 for those that are not known: they have no vote.
    seen : (t,) array of int
        Points that show each thing in the whole scan.
    names : list of (class, kind)
        Of every thing; the class is "" for what is none of the paper's.
    plan : Plan
        A Building is one thing with its windows, its doors and the houses of its row.
    """
    counts = np.bincount(things[things >= 0], minlength=len(names))
    labels, kinds = (np.array(part) for part in zip(*names, strict=True))
    votes = {label: int(counts[labels == label].sum()) for label in sorted(set(labels.tolist()))}
    label = max(votes, key=votes.__getitem__)
    wholes = (labels == label) & ~np.isin(kinds, PARTS)
    most = int(np.argmax(np.where(wholes, counts, -1)))
    own = votes[label] if label == "Building" else int(counts[most])
    reasons = (
        (FEW, len(things) < plan.least_points),
        (OTHER, not label or not own),
        (MIXED, own < plan.purity * counts.sum()),
        (FRAGMENT, not counts[most] or counts[most] < plan.whole * seen[most]),
    )
    return Truth(label, str(kinds[most]), next((reason for reason, holds in reasons if holds), ""))
