"""`laserimg map`: ground, clusters and the class of each, as pictures, points and a page in 3D."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from laserimg.semantic_map.maps import SemanticMap


def map_(
    paths: Annotated[list[Path], typer.Argument(metavar="SCAN...", help="Scan files, folders or globs.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for the map.")],
    model: Annotated[
        Path | None, typer.Option(help="Model of `laserimg classify train`. Default: the shipped ones.")
    ] = None,
    margin: Annotated[
        float | None,
        typer.Option(min=0, help="Best decision value less the second, below which it is unknown."),
    ] = None,
    min_range: Annotated[float | None, typer.Option(help="Metres; nearer returns are left out.")] = None,
    up: Annotated[str | None, typer.Option(help="Axis of the scanner that points up, such as -y.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 1,
    as_json: Annotated[bool, typer.Option("--json", help="Print map.json, not a table.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Map what stands on the ground: buildings, cars, people, trees, poles.

    All scans together are one map, each at the pose in its file. Colours are those of the paper: building
    brown, car yellow, person blue, tree green, pole red, ground and undersegmented clusters white; what
    the classifier is not sure of is gray.

    \b
      laserimg map street.npz -o map
      laserimg map scans/ -o map --jobs 2
      laserimg map street.npz -o map --model objects.npz --margin 0.3

    \b
    In the folder:
      map.html        the map in 3D, for any browser: turn, zoom, point at a cluster
      top.png         from above, north (world y) up
      panoramas/      a picture of every scan
      map.ply         all points, coloured, in world coordinates
      map.json        every cluster: class, confidence, size, position, and why
    """
    from laserimg.cli.progress import track
    from laserimg.cli.scan_files import scan_files
    from laserimg.semantic_map.fusing import fused
    from laserimg.semantic_map.maps import SemanticMap
    from laserimg.semantic_map.models import MapModels
    from laserimg.semantic_map.run import PAGE, RECORD, MapOptions, map_files, write_map

    files, errors = scan_files(paths, out)
    options = MapOptions(model, margin, min_range, _axis(up))
    found = {}
    for done in track(map_files(_named(files), options, out, jobs), len(files), "mapping", quiet):
        found[done.file] = done
    errors += [found[file].error for file in files if found[file].error]
    scans = [scan for file in files for scan in found[file].scans]
    if scans:
        whole = SemanticMap(fused(scans), MapModels.load(model).labels)
        write_map(whole, out, _title(files))
        if as_json:
            typer.echo((out / RECORD).read_text(encoding="utf-8"), nl=False)
        elif not quiet:
            _print_table(whole)
            typer.echo(f"map: {out / PAGE}")
        if len(scans) > 1 and all((one.world_from_scan == scans[0].world_from_scan).all() for one in scans):
            typer.echo("laserimg: all scans have the same pose: they lie over one another", err=True)
    for line in errors:
        typer.echo(f"laserimg: {line}", err=True)
    if errors:
        raise typer.Exit(1)


def _axis(up: str | None) -> str | None:
    from laserimg.errors import ConfigError
    from laserimg.geometry.mounting import axis_of

    try:
        if up is not None:
            axis_of(up)
    except ConfigError as error:
        raise typer.BadParameter(str(error), param_hint="--up") from None
    return up


def _named(files: list[Path]) -> list[tuple[Path, str]]:
    """Return the files with the names of their panoramas: what lies in folders stays in folders."""
    import os

    from laserimg.files import stem

    if not files:
        return []
    top = os.path.commonpath([file.absolute().parent for file in files])
    return [(file, str(file.absolute().parent.relative_to(top) / stem(file))) for file in files]


def _title(files: list[Path]) -> str:
    from laserimg.files import stem

    return stem(files[0]) + (f" and {len(files) - 1} more" if len(files) > 1 else "")


def _print_table(whole: "SemanticMap") -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from laserimg.semantic_map.colours import GROUND, LOOSE, palette

    grid = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("class", "objects", "points", "mean confidence"):
        grid.add_column(heading, justify="left" if heading == "class" else "right")
    for label in palette(whole.labels):
        those = [cluster for cluster in whole.clusters if cluster.label == label]
        if those:
            mean = sum(cluster.confidence for cluster in those) / len(those)
            points = sum(cluster.points for cluster in those)
            objects = len({cluster.number for cluster in those})
            grid.add_row(label, str(objects), f"{points:,}", f"{mean:.2f}")
    for label, number in ((GROUND, 0), (LOOSE, -1)):
        points = sum(int((one.cloud.cluster == number).sum()) for one in whole.scans)
        grid.add_row(label, "", f"{points:,}", "")
    Console(width=None if Console().is_terminal else 140).print(grid)
