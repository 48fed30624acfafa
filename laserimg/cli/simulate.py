"""`laserimg simulate`: labelled scans of scenes that no one had to build."""

from pathlib import Path
from typing import Annotated

import typer


def simulate(
    scene: Annotated[str, typer.Argument(help="corridor, office, park, stairwell or street.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for scans and truth.")],
    scanner: Annotated[str, typer.Option(help="lms151_turn or lms200_tilt.")] = "lms151_turn",
    count: Annotated[int, typer.Option(min=1, help="Scans to make.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="Another seed makes other scenes.")] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 1,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Make scans of random scenes, with the boxes and sizes of what is in them.

    A scan depends on scene, scanner, seed and its number alone. What is there already is kept: a larger
    --count adds to a set. Needs pip install "laserimg[simulate]".

    \b
      laserimg simulate office --count 20 -o offices
      laserimg simulate street --count 20 -o streets
      laserimg simulate park --scanner lms200_tilt --count 200 --seed 1 --jobs 2 -o parks
      laserimg detect streets -o found && laserimg evaluate found/detections.json streets/truth.coco.json
    """
    from laserimg.cli.progress import track
    from laserimg.simulate.scanner import SCANNERS
    from laserimg.simulate.scenes import SCENES
    from laserimg.simulate.sets import TRUTH, SetPlan, make_scans, write_truth

    for name, known, option in ((scene, SCENES, "scene"), (scanner, SCANNERS, "--scanner")):
        if name not in known:
            raise typer.BadParameter(f"known: {', '.join(sorted(known))}", param_hint=option)
    plan = SetPlan(scene, scanner, seed, out)
    for _ in track(make_scans(plan, count, jobs), count, "simulating", quiet):
        pass
    truth = write_truth(plan, count)
    if not quiet:
        typer.echo(f"{count} scans with {len(truth.annotations)} labelled objects; truth in {out / TRUTH}")
