"""`laserimg simulate`: labelled scans of scenes that no one had to build."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from laserimg.simulate.user_mesh import UserThing

# What is higher is meant in centimetres: no scene has room for it.
_MOST_HIGH_M = 15.0


def simulate(
    scene: Annotated[str, typer.Argument(help="corridor, office, park, stairwell or street.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for scans and truth.")],
    scanner: Annotated[
        str,
        typer.Option(
            help="lms151_turn, lms200_swing, lms200_tilt, lms200_tilt_cm, lms200_turn, spinning32, "
            "spinning40, spinning64, spinning128, terrestrial."
        ),
    ] = "lms151_turn",
    count: Annotated[int, typer.Option(min=1, help="Scans to make.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="Another seed makes other scenes.")] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 1,
    mesh: Annotated[Path | None, typer.Option(help="OBJ, STL, PLY or GLB file of an object to add.")] = None,
    label: Annotated[str | None, typer.Option("--class", help="Class of the mesh.")] = None,
    height: Annotated[str | None, typer.Option(help="Heights of the mesh in metres, as 0.2:0.6.")] = None,
    up: Annotated[str, typer.Option(help="Axis of the mesh that points up: y, z or auto.")] = "auto",
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Make scans of random scenes, with the boxes and sizes of what is in them.

    A scan depends on scene, scanner, mesh, seed and its number alone. What is there already is kept: a larger
    --count, another seed, scene or scanner adds to a folder of the same version of laserimg. --mesh puts an
    object of your own 1-4 times into every scene, scaled to --height; auto takes y as up in GLB files, z in
    others. Needs pip install "laserimg[simulate]".

    \b
      laserimg simulate office --count 20 -o offices
      laserimg simulate street --count 20 -o streets
      laserimg simulate park --scanner lms200_tilt --count 200 --seed 1 --jobs 2 -o parks
      laserimg simulate office --mesh bin.obj --class bin --height 0.2:0.6 --count 200 -o bins
      laserimg detect streets -o found && laserimg evaluate found/detections.json streets/truth.coco.json
    """
    from laserimg.cli.progress import track
    from laserimg.simulate.scanner import SCANNERS
    from laserimg.simulate.scenes import SCENES
    from laserimg.simulate.sets import TRUTH, SetPlan, is_shown, make_scans, write_truth

    for name, known, option in ((scene, SCENES, "scene"), (scanner, SCANNERS, "--scanner")):
        if name not in known:
            raise typer.BadParameter(f"known: {', '.join(sorted(known))}", param_hint=option)
    plan = SetPlan(scene, scanner, seed, out, _extras(mesh, label, height, up))
    for _ in track(make_scans(plan, count, jobs), count, "simulating", quiet):
        pass
    truth = write_truth(out)
    scans = {plan.name(number) for number in range(count)}
    for extra in plan.extras:
        if not is_shown(truth, extra.label, scans):
            typer.echo(
                f"laserimg: no scan shows {extra.label!r}: too large or small for the scene?", err=True
            )
    if not quiet:
        whole = f"{len(truth.images)} scans with {len(truth.annotations)} labelled objects"
        typer.echo(f"{whole} in {out}; their truth: {out / TRUTH}")


def _extras(mesh: Path | None, label: str | None, height: str | None, up: str) -> "tuple[UserThing, ...]":
    from laserimg.simulate.user_mesh import user_thing

    if mesh is None:
        if label or height:
            raise typer.BadParameter("--class and --height need a --mesh", param_hint="--mesh")
        return ()
    if not label or not height:
        raise typer.BadParameter("needs --class and --height", param_hint="--mesh")
    return (user_thing(mesh, label, height_range(height), up),)


def height_range(text: str) -> tuple[float, float]:
    """Return two heights in metres written as ``0.2:0.6``, or one for both."""
    low, _, high = text.partition(":")
    try:
        heights = float(low), float(high or low)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not two heights as 0.2:0.6", param_hint="--height") from None
    if max(heights) > _MOST_HIGH_M:
        raise typer.BadParameter(
            f"{text} is in metres, at most {_MOST_HIGH_M:g}; 20 cm is 0.2", param_hint="--height"
        )
    return heights
