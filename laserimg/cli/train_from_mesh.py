"""``laserimg train from-mesh``: a detector from a mesh alone."""

from pathlib import Path
from time import perf_counter

import typer


def from_mesh(
    mesh: Path = typer.Argument(..., help="OBJ, STL, PLY or GLB."),
    label: str = typer.Option(..., "--class", help="Name of the class: small letters, digits and _."),
    height: str = typer.Option(..., help="Least and greatest height in metres, such as 0.2:0.6."),
    out: Path = typer.Option(..., "--out", "-o", help="Folder for the detector, its cards and rules.toml."),
    scene: str = typer.Option("office", help="Where it stands: corridor, office, park, stairwell or street."),
    up: str = typer.Option("auto", help="Axis that points up in the file: auto, y or z."),
    scans: int = typer.Option(400, min=2, help="Simulated scans to train on."),
    seed: int = typer.Option(0, min=0, help="Another seed makes other scenes."),
    jobs: int = typer.Option(0, min=0, help="Worker processes; 0 is one a core."),
    as_json: bool = typer.Option(False, "--json", help="Print the scores as JSON."),
    quiet: bool = typer.Option(False, "--quiet", "-q", help="Print nothing but errors."),
) -> None:
    """Train a detector for an object of which there is a mesh: simulate, train, measure, write rules.

    The folder gets NAME.depth.xml and NAME.npz with their cards, rules.toml with limits in metres, and the
    simulated scans. Needs pip install "laserimg[simulate]".

    \b
      laserimg train from-mesh bin.obj --class bin --height 0.2:0.6 -o bin
      laserimg detect office.pcd --cascades bin --rules bin/rules.toml -o found
      laserimg train from-mesh hydrant.glb --class hydrant --height 0.6:1.0 --scene street -o hydrant
    """
    import json
    import re
    from dataclasses import asdict

    from laserimg.cli.progress import stepping
    from laserimg.cli.simulate import height_range
    from laserimg.cli.train_recipe import cores, table
    from laserimg.files import make_folder, write_text
    from laserimg.recipes.from_mesh import recipe_of_mesh, rules_of_mesh
    from laserimg.recipes.run import TrainingRun, follow
    from laserimg.rules.file import parse_rules
    from laserimg.simulate.scenes import SCENES
    from laserimg.simulate.user_mesh import user_thing

    if scene not in SCENES:
        raise typer.BadParameter(f"known: {', '.join(sorted(SCENES))}", param_hint="--scene")
    if not re.fullmatch(r"[a-z0-9_]+", label):
        raise typer.BadParameter(
            f"'{label}' is not made of small letters, digits and _", param_hint="--class"
        )
    begin = perf_counter()
    thing = user_thing(mesh, label, height_range(height), up)
    make_folder(out)
    run = TrainingRun(out / "simulated", out, jobs or cores(), (thing,))
    recipe = recipe_of_mesh(thing, scene, scans, seed)
    rules = parse_rules(rules_of_mesh(thing))[label]
    trained = follow(recipe, run, rules, stepping(quiet or as_json))
    write_text(out / "rules.toml", rules_of_mesh(thing, trained.score))
    if as_json:
        typer.echo(json.dumps([asdict(one) for one in trained.steps]))
    elif not quiet:
        typer.echo(table(label, trained, perf_counter() - begin))
        typer.echo(f"laserimg detect SCAN --cascades {out} --rules {out / 'rules.toml'} -o found")
