"""`laserimg convert`: a scan in another format."""

from pathlib import Path
from typing import Annotated

import typer


def convert(
    file: Annotated[Path, typer.Argument(help="Scan file.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="File to write: .npz, .ptx, .pcd or .png.")],
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Write the scans of a file in another format, on their grid and upright.

    \b
      laserimg convert office.pcd -o office.npz
      laserimg convert scan000.3d -o scan000.ptx

    \b
    Formats:
      .npz  all that a scan holds
      .ptx  points, intensity, pose; several scans in one file
      .pcd  points as an organised grid, intensity, pose
      .png  range in millimetres, 16 bit, with NAME.json; only grids of azimuth and elevation
    """
    from laserimg.formats.scans import SUFFIXES, write_scans
    from laserimg.readers import open_scans

    if out.suffix.lower() not in SUFFIXES:
        raise typer.BadParameter(f"known formats: {' '.join(SUFFIXES)}", param_hint="--out")
    for path in write_scans(list(open_scans(file)), out):
        if not quiet:
            typer.echo(str(path))
