"""A recipe and rules for an object of which there is a mesh."""

import numpy as np

from laserimg.recipes.recipe import CascadeRecipe, Recipe, ScanSet
from laserimg.simulate.user_mesh import UserThing, standing

# Pixels of a window; its sides are in the ratio of the object's, at least this many.
_WINDOW_AREA, _LEAST_SIDE, _MOST_SIDE = 480, 12, 48
# Measured sizes of a thing partly hidden, or cut at the foot, are smaller than its own; noise adds.
_SMALLEST, _LARGEST = 0.6, 1.15
# Whose scans to learn from: rooms are seen by other scanners than streets.
INDOORS, OUTDOORS = ("lms200_turn", "lms200_tilt"), ("spinning128", "spinning64", "terrestrial")
_OUTDOOR_SCENES = ("park", "street")


def recipe_of_mesh(thing: UserThing, scene: str, scans: int, seed: int) -> Recipe:
    """Return the recipe of a detector for a mesh: one cascade on relative depth, regions, a second stage.

    Parameters
    ----------
    thing : UserThing
    scene : str
        Where it is found.
    scans : int
        To train on, by some scanners of such places in equal parts.
    seed : int
    """
    width, height = usual_size(thing)
    ratio = width / height
    window = tuple(
        int(np.clip(round(side), _LEAST_SIDE, _MOST_SIDE))
        for side in (np.sqrt(_WINDOW_AREA * ratio), np.sqrt(_WINDOW_AREA / ratio))
    )
    scanners = OUTDOORS if scene in _OUTDOOR_SCENES else INDOORS
    sets = tuple(ScanSet(scene, scanner, max(1, scans // len(scanners))) for scanner in scanners)
    size = round(width, 3), round(height, 3)
    cascade = CascadeRecipe("depth", "depth_relative", (window[0], window[1]), size)
    return Recipe(thing.label, sets, (cascade,), seed)


def usual_size(thing: UserThing) -> tuple[float, float]:
    """Return the usual width and height in metres: the mean of all turns, and of the heights."""
    points, _ = standing(thing.path, thing.up)
    height = sum(thing.height_m) / 2
    angles = np.radians(np.arange(0, 180, 15))
    across = points[:, :2] @ np.stack([np.cos(angles), np.sin(angles)])
    return float(np.ptp(across, axis=0).mean() * height), height


def rules_of_mesh(thing: UserThing, score: float = 0.0) -> str:
    """Return a rule file for the class: what a scan can show of the sizes that the mesh has, and a score."""
    points, _ = standing(thing.path, thing.up)
    low, high = thing.height_m
    angles = np.radians(np.arange(0, 180, 5))
    spans = np.ptp(points[:, :2] @ np.stack([np.cos(angles), np.sin(angles)]), axis=0)
    height = f"[{_SMALLEST * low:.2f}, {_LARGEST * high:.2f}]"
    width = f"[{_SMALLEST * low * spans.min():.2f}, {_LARGEST * high * spans.max():.2f}]"
    return (
        f"# Limits in metres for {thing.path.name}, {low:g} to {high:g} m high:\n"
        f"# {_SMALLEST:g} of its least to {_LARGEST:g} times its greatest size, as a part may be hidden.\n"
        f'format = 1\n\n[{thing.label}]\nfrom = ["cascade", "regions"]\n'
        f'score = {score:g}\non_fail = "doubt"\n'
        f'height = {height}\nwidth = {width}\npoints = [30, "-"]\n'
    )
