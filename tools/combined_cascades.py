"""Several cascades of one class without a second stage: each alone, together, and when they must agree.

    python tools/combined_cascades.py --work simulated              # doors and cars, all test scans
    python tools/combined_cascades.py --work simulated door --scans 20

`--work` holds the simulated scans of `laserimg train recipe`; those that are missing are simulated.
"""

import argparse
from functools import partial
from pathlib import Path

import numpy as np

from laserimg.cascade.folder import one_thread
from laserimg.detectors.agreement import Agreement
from laserimg.detectors.candidate import Candidate
from laserimg.detectors.search import WindowDetector
from laserimg.detectors.shipped import load_model, shipped_folder
from laserimg.evaluate.curves import Curve
from laserimg.evidence import Evidence
from laserimg.recipes.measuring import Found, matched
from laserimg.recipes.observation import killed, observed
from laserimg.recipes.recipe import Recipe, read_recipe
from laserimg.recipes.scans import TrainingScan, scans_of
from laserimg.workers import in_order
from proposal_counts import some_of

ROOT = Path(__file__).parents[1]


def combined(windows: tuple[WindowDetector, ...], evidence: Evidence) -> dict[str, list[Candidate]]:
    """Return what is proposed in a scan, for each way of combining."""
    ways = {window.model.name: window(evidence) for window in windows}
    ways["all, each box"] = [one for found in list(ways.values()) for one in found]
    for least in range(1, len(windows) + 1):
        name = "all, of a place the surest" if least == 1 else f"agree = {least}"
        ways[name] = Agreement(windows, least)(evidence)
    return ways


def looked_at(recipe: Recipe, cascades: Path, scan: TrainingScan) -> tuple[dict[str, Found], int]:
    """Return what each way finds in a scan, and how many objects are asked for."""
    models = [load_model(cascades / f"{recipe.label}.{one.name}.xml") for one in recipe.cascades]
    asked, ignored = scan.objects(recipe)
    with one_thread():
        evidence = observed(scan.path)
        ways = combined(tuple(WindowDetector(model) for model in models), evidence)  # type: ignore[arg-type]
    width = evidence.scan.shape[1] if evidence.scan.wraps else None
    scored = {name: [(one.box, one.score) for one in found] for name, found in ways.items()}
    return {name: matched(found, asked, ignored, width) for name, found in scored.items()}, len(asked)


def _died(scan: TrainingScan) -> tuple[dict[str, Found], int]:
    raise killed(scan)


def main() -> None:
    """Print a line for each class and way of combining."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("labels", nargs="*", metavar="CLASS", help="default: those with several cascades")
    parser.add_argument("--work", type=Path, required=True, help="folder of simulated scans")
    parser.add_argument("--cascades", type=Path, default=shipped_folder(), help="folder of detectors")
    parser.add_argument("--scans", type=int, default=0, help="about so many test scans a class; 0 is all")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    print(f"{'class':14}{'what proposes':30} scans  objects  AP@0.5  recall  false a scan")
    for recipe in map(read_recipe, sorted((ROOT / "training").glob("*.toml"))):
        several = len(recipe.cascades) > 1
        if recipe.label not in given.labels if given.labels else not several:
            continue
        test = scans_of(recipe, "test", given.work, given.jobs)
        chosen = some_of(test, given.scans)
        results = in_order(partial(looked_at, recipe, given.cascades), chosen, given.jobs, _died)
        objects = sum(count for _, count in results)
        for name in results[0][0]:
            scores = np.concatenate([found[name].scores for found, _ in results])
            hits = np.concatenate([found[name].hits for found, _ in results])
            precision = Curve.of(scores, hits, objects, len(chosen)).average_precision
            recall, wrong = hits.sum() / max(objects, 1), (~hits).sum() / len(chosen)
            counts = f"{len(chosen):6}{objects:9}"
            print(f"{recipe.label:14}{name:30}{counts}{precision:8.3f}{recall:8.3f}{wrong:14.1f}", flush=True)


if __name__ == "__main__":
    main()
