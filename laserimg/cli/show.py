"""``laserimg show``: the picture of a scan and its detections, on the screen."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from laserimg.pipeline import Result
    from laserimg.scan import Scan


def show(
    file: Annotated[Path, typer.Argument(help="A scan file.")],
    image: Annotated[
        str, typer.Option(metavar="KIND", help="What lies under the boxes: any of `laserimg images`.")
    ] = "normals",
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="PNG to write. Default: a new temporary folder.")
    ] = None,
    number: Annotated[int, typer.Option("--scan", min=0, help="Number of the scan in the file.")] = 0,
    rules: Annotated[Path | None, typer.Option(help="Rule file. Default: the shipped rules.")] = None,
    cascades: Annotated[
        str | None, typer.Option(help="Folder or file of detectors, or 'none'. Default: the shipped ones.")
    ] = None,
    source: Annotated[
        list[str] | None,
        typer.Option("--from", help="Where candidates come from: cascade, hog, regions, clusters."),
    ] = None,
    open_: Annotated[bool, typer.Option("--open/--no-open", help="Open the picture in a viewer.")] = True,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Show a scan with what was detected and rejected.

    Detects as `laserimg detect` does. Detections are green; what was rejected is red, with the
    reason. Without a display it only says where the picture is.

    \b
      laserimg show office.pcd
      laserimg show 1.ptx --image reflectance
      laserimg show office.pcd --no-open -o office.png
    """
    from laserimg.build import Build
    from laserimg.cli.usage import settings_of

    _check_names(image, out)
    settings = settings_of(
        rules=str(rules) if rules else None, cascades=cascades, sources=tuple(source or ())
    )
    pipeline = Build(settings).pipeline()
    result = pipeline(_scan(file, number))
    picture = _write(result, image, out, file)
    if not quiet:
        print(f"{len(result.detections)} detections; picture: {picture}")
    if open_ and _has_display():
        typer.launch(str(picture))


def _check_names(image: str, out: Path | None) -> None:
    from laserimg.errors import ConfigError
    from laserimg.images import check_image_name

    try:
        check_image_name(image)
    except ConfigError as error:
        raise typer.BadParameter(str(error), param_hint="--image") from None
    if out is not None and out.suffix.lower() != ".png":
        raise typer.BadParameter(f"'{out}' does not end in .png", param_hint="-o")


def _scan(file: Path, number: int) -> "Scan":
    from itertools import islice

    from laserimg.errors import ScanError
    from laserimg.readers import find_files, read_file

    files = find_files([file])
    if len(files) > 1:
        raise typer.BadParameter(f"'{file}' is {len(files)} scan files; name one", param_hint="FILE")
    scan = next(islice(read_file(files[0]), number, None), None)
    if scan is None:
        raise ScanError(f"{file}: has no scan {number}")
    return scan


def _write(result: "Result", image: str, out: Path | None, file: Path) -> Path:
    import tempfile

    from laserimg.draw import overlay
    from laserimg.errors import ScanError
    from laserimg.files import stem
    from laserimg.images import write_png

    try:
        drawn = overlay(result, image)
    except ScanError as error:
        raise ScanError(f"{file}: {error}") from error
    picture = out or Path(tempfile.mkdtemp(prefix="laserimg-")) / f"{stem(file)}.png"
    write_png(picture, drawn)
    return picture


def _has_display() -> bool:
    import os
    import sys

    return sys.platform in ("darwin", "win32") or bool(
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    )
