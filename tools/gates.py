"""What checks, as gates, take from the proposals of cascades: hits that are lost, false ones removed.

    python tools/gates.py --work simulated                       # all classes, 60 scans each
    python tools/gates.py --work simulated wastebasket --scans 0   # all of its test scans

`--work` holds the simulated scans of `laserimg train recipe`; those that are missing are simulated. An
object counts as hit as long as one proposal with IoU 0.5 is left.
"""

import argparse
import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np

from laserimg.detectors.box_samples import seen_box
from laserimg.detectors.shipped import load_model
from laserimg.evidence import Evidence
from laserimg.pipeline import Finding, Pipeline
from laserimg.recipes.measuring import boxes_of
from laserimg.recipes.observation import observed
from laserimg.recipes.recipe import Recipe, read_recipe
from laserimg.recipes.scans import scans_of
from laserimg.rules.checks import plausible_box
from laserimg.rules.file import load_rules
from laserimg.rules.model import QUANTITIES, ClassRules, Rules
from laserimg.sources import detectors_for
from proposal_counts import counted, some_of

ROOT = Path(__file__).parents[1]
CONTINUITY = frozenset({"region", "region_inside", "region_fills"})
# Shares of a region that must lie in the box, and of the box that it must fill, in the loose variants.
LOOSE = ((0.5, 0.3), (0.4, 0.15), (0.2, 0.1))

Gate = Callable[[Finding], bool]


def passes(*names: str) -> Gate:
    """Return whether a finding passes those checks that it has of some."""
    return lambda finding: all(check.passed for check in finding.checks if check.name in names)


def gates_of(evidence: Evidence, rules: ClassRules) -> dict[str, Gate]:
    """Return the gates that are compared, by what they are called."""
    return {
        "continuity": passes(*CONTINUITY),
        "sizes": passes(*QUANTITIES),
        "continuity, sizes (paper 2)": passes(*CONTINUITY, *QUANTITIES),
        "floor contact": passes("height_above_floor"),
        "rectangle within twice": lambda one: all(
            check.passed for check in plausible_box(seen_box(evidence, one.box), rules)
        ),
    }


def pipeline_of(recipe: Recipe, rules: ClassRules) -> Pipeline:
    """Return the pipeline of a recipe's shipped cascades alone, with the paper's gates."""
    models = [load_model(ROOT / "cascades" / f"{recipe.label}.{one.name}.xml") for one in recipe.cascades]
    asked = Rules((dataclasses.replace(rules, on_fail="reject", score=0.0),))
    return Pipeline(asked, detectors_for(asked, models, ("cascade",)))


def taken(recipe: Recipe, work: Path, scans: int) -> dict[str, np.ndarray]:
    """Return, for every gate, the objects hit and the false proposals that are left; "none" leaves all."""
    rules = load_rules()[recipe.label]
    plain = pipeline_of(recipe, rules)
    loose = {
        f"{inside} {fills}": pipeline_of(
            recipe, dataclasses.replace(rules, region_inside=inside, region_fills=fills)
        )
        for inside, fills in LOOSE
    }
    test = scans_of(recipe, "test", work, 2)
    counts: dict[str, np.ndarray] = {}
    for scan in some_of(test, scans):
        asked, ignored = scan.objects(recipe)
        evidence = observed(scan.path)
        gates = {"none": lambda one: True, **gates_of(evidence, rules)}
        findings = plain.judge(evidence)
        kept = {name: [one for one in findings if gate(one)] for name, gate in gates.items()}
        for shares, pipeline in loose.items():
            judged = pipeline.judge(evidence)
            kept[f"continuity {shares}"] = list(filter(passes(*CONTINUITY), judged))
            kept[f"continuity, sizes {shares}"] = list(filter(passes(*CONTINUITY, *QUANTITIES), judged))
        width = evidence.scan.shape[1] if evidence.scan.wraps else None
        for name, left in kept.items():
            boxes = boxes_of([one.box for one in left])
            counts[name] = counts.get(name, np.zeros(3, int)) + counted(boxes, asked, ignored, width)
    return counts


def main() -> None:
    """Print a line for each class and gate."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("labels", nargs="*", metavar="CLASS")
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--scans", type=int, default=60, help="about so many test scans a class; 0 is all")
    arguments = parser.parse_args()
    recipes = [read_recipe(path) for path in sorted((ROOT / "training").glob("*.toml"))]
    print(f"{'class':14}{'gate':30}{'objects hit':>14}{'lost':>8}{'false':>9}{'removed':>9}")
    for recipe in recipes:
        if arguments.labels and recipe.label not in arguments.labels:
            continue
        counts = taken(recipe, arguments.work, arguments.scans)
        hits, false, objects = counts["none"]
        for name, (left, wrong, _) in counts.items():
            of = f"{left} of {objects}"
            lost, removed = 1 - left / max(hits, 1), 1 - wrong / max(false, 1)
            print(f"{recipe.label:14}{name:30}{of:>14}{lost:8.1%}{wrong:9}{removed:9.1%}", flush=True)


if __name__ == "__main__":
    main()
