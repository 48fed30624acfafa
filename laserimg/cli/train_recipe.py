"""``laserimg train recipe``: detectors from simulated scans alone."""

from dataclasses import asdict
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from laserimg.recipes.run import Outcome
    from laserimg.rules.model import ClassRules, Rules


def recipe(
    files: list[Path] = typer.Argument(..., metavar="RECIPE.toml...", help="Recipes, one a detector."),
    out: Path = typer.Option(..., "--out", "-o", help="Folder for the detectors and their cards."),
    work: Path = typer.Option(
        Path("simulated"),
        help="Folder of simulated scans; recipes share them, and a second run keeps them. After an upgrade "
        "that changes the simulator it must be a fresh one.",
    ),
    rules: Path | None = typer.Option(None, help="Rule file to measure with. Default: the shipped rules."),
    jobs: int = typer.Option(0, min=0, help="Worker processes; 0 is one a core."),
    seed: int | None = typer.Option(None, min=0, help="In place of the recipe's."),
    scale: float = typer.Option(1.0, min=0.001, max=100, help="Times as many scans as the recipe says."),
    as_json: bool = typer.Option(False, "--json", help="Print the scores as JSON."),
    quiet: bool = typer.Option(False, "--quiet", "-q", help="Print nothing but errors."),
) -> None:
    """Train detectors as their recipes say: simulate scans, train cascades and a second stage, measure.

    A detector is NAME.IMAGE.xml for each of its cascades and NAME.npz, its second stage, each with a card.
    The card of the second stage says which score leaves at most two false ones in nine scans; rules name it.
    Needs pip install "laserimg[simulate]".

    \b
      laserimg train recipe training/wastebasket.toml -o detectors
      laserimg train recipe training/*.toml -o cascades --work scans --jobs 2
      laserimg train recipe training/car.toml -o quick --scale 0.1
    """
    import json
    from dataclasses import replace

    from laserimg.cli.progress import stepping
    from laserimg.files import make_folder
    from laserimg.recipes.recipe import read_recipe
    from laserimg.recipes.run import TrainingRun, follow
    from laserimg.rules.file import load_rules

    recipes = [read_recipe(file) for file in files]
    all_rules = load_rules(rules)
    run = TrainingRun(work, out, jobs or cores())
    make_folder(out)
    scores = {}
    for one in recipes:
        begin = perf_counter()
        chosen = one.scaled(scale)
        chosen = chosen if seed is None else replace(chosen, seed=seed)
        trained = follow(chosen, run, rules_of(one.label, all_rules), stepping(quiet or as_json))
        scores[one.label] = [asdict(score) for score in trained.steps]
        if not (quiet or as_json):
            typer.echo(table(one.label, trained, perf_counter() - begin))
    if as_json:
        typer.echo(json.dumps(scores))


def rules_of(label: str, rules: "Rules") -> "ClassRules":
    """Return the rules of a class; of one without, what the shipped rules say of all classes."""
    from laserimg.rules.model import ClassRules

    if label in rules:
        return rules[label]
    return ClassRules(label, ("cascade", "regions"), on_fail="doubt")


def table(label: str, trained: "Outcome", seconds: float) -> str:
    """Return the scores of a class after each step, a line each."""
    first = trained.steps[0]
    lines = [
        f"{label}: {first.objects} objects in {first.scans} scans, score {trained.score:g}, {seconds:.0f} s",
        *(
            f"  {one.step:<18} AP@0.5 {one.average_precision:.3f}  recall {one.recall:.3f}  "
            f"false a scan {one.false_per_scan:.2f}"
            for one in trained.steps
        ),
    ]
    return "\n".join(lines)


def cores() -> int:
    """Return how many cores this process may use."""
    import os

    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
