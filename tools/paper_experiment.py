"""Paper 1's experiment on a simulated LMS 151: three tables, controls, pictures.

    python tools/paper_experiment.py -o paper-experiment
    python tools/paper_experiment.py --seeds 900 --jobs 1 -o trial

For every seed: scans of streets and parks, cut into objects by our own ground removal and clusters, until
there are 103 buildings, 104 cars, 124 people, 131 trees and 28 poles; each is classified by a linear machine
trained on all others. What is fixed before, and what came out, is in ``docs/paper_experiment.md``. Seeds from
900 on are for trials.
"""

import argparse
import json
import time
from dataclasses import asdict
from pathlib import Path

from laserimg.errors import LaserImgError
from laserimg.images import write_png
from laserimg.workers import unordered
from paper_one.pictures import confusion_sheet, errors_sheet
from paper_one.plan import SEEDS, Plan
from paper_one.run import PAPER, SETS, SHAPE, Run, run_of
from paper_one.tables import comparison, kinds, orders, paper_table, pooled, refusals

ORDERS = [
    ("HONV", "HONV and HOG"),
    ("HONV and HOG", "3DHOG"),
    ("HONV", "3DHOG"),
    ("3DHOG", "3DHOG and HOG"),
    ("HONV and HOG, gradients of range", "HONV and HOG"),
    ("3DHOG, gradients of range", "3DHOG"),
]


def report(runs: list[Run]) -> str:
    """Return all tables in Markdown."""
    best = max(SETS, key=lambda name: pooled(runs, name).accuracy)
    parts = [f"## {name}\n\n" + "\n".join(paper_table(pooled(runs, name))) for name in SETS]
    parts += [
        "## All ways of classifying\n\n" + "\n".join(comparison(runs)),
        "## Which is better\n\n" + "\n".join(orders(runs, ORDERS)),
        "## Kinds\n\n" + "\n".join(kinds(runs, [*PAPER, SHAPE])),
        "## Clusters left out\n\n" + "\n".join(refusals(runs)),
        f"Best set of features: {best}. Scans: {' '.join(str(run.scans) for run in runs)}.",
    ]
    return "\n\n".join(parts) + "\n"


def as_json(runs: list[Run]) -> str:
    """Return the tables of every seed, its plan and its times."""
    entries = [
        {
            "plan": asdict(run.plan),
            "scans": run.scans,
            "seconds": {part: round(spent, 2) for part, spent in run.seconds.items()},
            "tables": {name: pooled([run], name).as_dict() for name in run.taken_for},
        }
        for run in runs
    ]
    return json.dumps(entries, indent=1) + "\n"


def _died(plan: Plan) -> Run:
    raise LaserImgError(f"the process of seed {plan.seed} was killed; --jobs 1 needs less memory")


def main() -> None:
    """Run the experiment and write its tables and pictures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path, default=Path("paper-experiment"))
    arguments = parser.parse_args()
    start, runs = time.perf_counter(), []
    for run in unordered(run_of, [Plan(seed) for seed in arguments.seeds], arguments.jobs, _died):
        runs.append(run)
        print(f"seed {run.plan.seed}: {run.scans} scans, {time.perf_counter() - start:.0f} s", flush=True)
    runs.sort(key=lambda run: run.plan.seed)
    arguments.out.mkdir(parents=True, exist_ok=True)
    text = report(runs)
    print("\n" + text)
    (arguments.out / "report.md").write_text(text, encoding="utf-8")
    (arguments.out / "tables.json").write_text(as_json(runs), encoding="utf-8")
    write_png(arguments.out / "confusion.png", confusion_sheet(runs, list(PAPER)))
    for name, features in SETS.items():
        write_png(arguments.out / f"errors-{features}.png", errors_sheet(runs, name))


if __name__ == "__main__":
    main()
