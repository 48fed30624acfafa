"""``laserimg images``: the images of scans as PNG files."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from laserimg.scan import Scan


def images(
    paths: Annotated[list[Path], typer.Argument(help="Scan files, folders or globs.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for the pictures, STEM.KIND.png.")],
    kinds: Annotated[
        str | None, typer.Option(help="Images separated by commas. Default: all that the scan has.")
    ] = None,
    colour: Annotated[
        Path | None,
        typer.Option(help="Colour image registered to the one scan: its grey becomes the reflectance."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Write what detectors see of a scan, as PNG files.

    \b
      laserimg images office.pcd -o pictures
      laserimg images scans/ -o pictures --kinds range,normals
      laserimg images 1.ptx -o pictures --kinds normals_view.r
      laserimg images depth.png -o pictures --colour colour.png

    \b
    Kinds:
      range           distance, from its 1st to its 99th percentile: near is dark
      reflectance     the sensor's values, from their 1st to their 99th percentile
      normals         n_x, n_y, n_z of the scanner's frame as red, green, blue
      normals_abs     their absolute values
      normals_view    towards the scanner, to the right, up, as red, green, blue
      depth_relative  distance less its mean within 0.45 m
      normals.r       one plane of normals, normals_abs or normals_view: .r .g .b
    """
    from laserimg.cli.progress import track
    from laserimg.cli.scan_files import scan_files
    from laserimg.errors import ConfigError, LaserImgError
    from laserimg.images import check_image_name

    names = kinds.split(",") if kinds else None
    try:
        for name in names or ():
            check_image_name(name)
    except ConfigError as error:
        raise typer.BadParameter(str(error), param_hint="--kinds") from None
    (files, errors), written = scan_files(paths), 0
    # Two files may have the same name: what lies in folders stays in folders.
    top = os.path.commonpath([file.absolute().parent for file in files]) if files else ""
    if colour is not None and len(files) > 1:
        raise typer.BadParameter(
            'goes with one scan; for several, write "colour" in NAME.json', param_hint="--colour"
        )
    for file in track(files, len(files), "images", quiet):
        try:
            written += _write_file(file, out / file.absolute().parent.relative_to(top), names, colour)
        except LaserImgError as error:
            errors.append(str(error))
    if written and not quiet:
        typer.echo(f"{written} images written to {out}")
    for line in errors:
        typer.echo(f"laserimg: {line}", err=True)
    if errors:
        raise typer.Exit(1)


def _write_file(file: Path, folder: Path, names: list[str] | None, colour: Path | None) -> int:
    from laserimg.errors import LaserImgError, ScanError
    from laserimg.files import stem
    from laserimg.images import make_images, write_png
    from laserimg.readers import read_file
    from laserimg.readers.colour import with_colour

    written = 0
    for scan in read_file(file):
        try:
            if colour is not None:
                scan = with_colour(scan, colour)
            pictures = make_images(scan, names or _all_kinds(scan))
        except LaserImgError as error:
            raise ScanError(f"{file}: {error}") from error
        number = f".{scan.index}" if scan.index else ""
        for name, picture in pictures.items():
            write_png(folder / f"{stem(file)}{number}.{name}.png", picture)
        written += len(pictures)
    return written


def _all_kinds(scan: "Scan") -> list[str]:
    from laserimg.images import IMAGE_KINDS

    return [kind for kind in IMAGE_KINDS if kind != "reflectance" or scan.reflectance is not None]
