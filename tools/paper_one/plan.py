"""What is fixed before anything is classified; `docs/paper_experiment.md` says why."""

from dataclasses import dataclass, field

# What stands in a scene, by the label or else the kind of a thing, and its class in the paper.
# Hedges and low walls have the size of cars: as Tree and Building they keep size from telling the class.
CLASS_OF = {
    "building": "Building",
    "window": "Building",
    "door": "Building",
    "low_wall": "Building",
    "car": "Car",
    "person": "Human",
    "tree": "Tree",
    "hedge": "Tree",
    "pole": "Pole",
}
# What has a class although the paper shows none of it.
FURTHER = ("hedge", "low_wall")
# Of a building, but no building by themselves.
PARTS = ("window", "door")
# Paper 1, table 1, in its order.
IMAGES = {"Building": 103, "Car": 104, "Human": 124, "Tree": 131, "Pole": 28}
SEEDS = (101, 102)


@dataclass(frozen=True, slots=True)
class Plan:
    """Which scans are made and which of their clusters are objects.

    Parameters
    ----------
    seed : int
    scenes : tuple of str
        Scans are made of each in turn, numbered from 0, until every class has its images; they are those
        of ``laserimg simulate SCENE --seed SEED``.
    scanner : str
    most_scans : int
        Of each kind of scene.
    least_points : int
        Fewer returns than this are no image.
    off_m : float
        A point farther than this from what the middle of its beam hits is a mixed pixel, and has no vote.
    purity : float
        Smallest share of the votes in a cluster for one thing; below, it is undersegmented.
    whole : float
        Smallest share of the points that show its thing in a cluster; below, it is a fragment.
    images : dict of str to int
        Objects of each class: the first ones found.
    """

    seed: int
    scenes: tuple[str, ...] = ("street", "park")
    scanner: str = "lms151_turn"
    most_scans: int = 120
    least_points: int = 100
    off_m: float = 0.2
    purity: float = 0.9
    whole: float = 0.5
    images: dict[str, int] = field(default_factory=lambda: dict(IMAGES))
