"""``laserimg samples``: make and look at the positives of a training."""

from pathlib import Path

import typer


def samples(
    positives: Path = typer.Argument(
        ..., help="A .vec, a folder of crops, COCO, VOC, imglab, YOLO, or OpenCV's info.dat."
    ),
    out: Path = typer.Option(..., "--out", "-o", help="A .vec, a .png of all, or a folder of crops."),
    window: str = typer.Option("24x24", help="Width x height in pixels."),
    label: str | None = typer.Option(None, "--class", help="The class of the labels to take."),
    margin: float = typer.Option(0.0, min=0.0, help="Border round a labelled box, as a share of it."),
    count: int = typer.Option(0, min=0, help="Samples to make; 0 takes each positive once."),
    turn: str = typer.Option("0,0,0", help="Turns at most, in degrees, about the axes across, up, forward."),
    shift: float = typer.Option(0.0, help="Shift at most, as a share of the window."),
    scale: float = typer.Option(0.0, help="Change of size at most, as a share."),
    contrast: float = typer.Option(0.0, help="Change of contrast at most, as a share."),
    brightness: float = typer.Option(0.0, help="Change of brightness at most, in grey levels."),
    noise: float = typer.Option(0.0, help="Noise, standard deviation in grey levels."),
    dropped: float = typer.Option(0.0, help="Share of pixels without a return (0)."),
    mirror: bool = typer.Option(False, "--mirror", help="Mirror half of them."),
    invert: bool = typer.Option(False, "--invert", help="Invert half of them."),
    image: str = typer.Option("", help="Which image of a scan it is: varied only as scans vary."),
    images_of_scans: Path | None = typer.Option(
        None, "--images", help="Labels of scans: the folder that laserimg images wrote; --image says which."
    ),
    backgrounds: Path | None = typer.Option(None, help="Folder or list: shown through pixels of one grey."),
    transparent: int = typer.Option(0, min=0, max=255, help="The grey that backgrounds show through."),
    tolerance: int = typer.Option(0, min=0, max=255, help="How far a pixel may be from that grey."),
    seed: int = typer.Option(0, min=0, help="Another seed makes other samples."),
    quiet: bool = typer.Option(False, "--quiet", "-q", help="Print nothing when all is well."),
) -> None:
    """Make samples for training, as opencv_createsamples did, or look at them.

    \b
      laserimg samples info.dat --window 20x20 -o pos.vec
      laserimg samples pos.vec --window 20x20 -o sheet.png
      laserimg samples chairs.json --class chair --count 500 --mirror --turn 5,10,5 -o chairs.vec
      laserimg samples logo.png.folder --count 1000 --backgrounds photos --transparent 255 -o logo.vec
    """
    import sys

    import numpy as np

    from laserimg.cli.sizes import window_of
    from laserimg.errors import ConfigError
    from laserimg.samples.augment import Variation, paste, vary
    from laserimg.samples.positives import read_positives
    from laserimg.samples.writing import ground_windows, write_samples

    size = window_of(window)
    try:
        variation = Variation(
            _turns(turn),
            shift,
            scale,
            contrast,
            brightness,
            noise,
            dropped,
            mirror,
            invert,
            image,
        )
    except ConfigError as error:
        raise typer.BadParameter(str(error)) from None
    pictures = (images_of_scans, image) if images_of_scans else None
    found = read_positives(positives, size, margin, label, pictures)
    for line in found.skipped[:20]:
        print(f"left out: {line}", file=sys.stderr)
    rng = np.random.default_rng(seed)
    made = found.windows
    if count or variation != Variation():
        made = vary(made, count or len(made), variation, rng)
    if backgrounds:
        made = paste(made, ground_windows(backgrounds, size, len(made), rng), transparent, tolerance, rng)
    write_samples(out, made)
    if not quiet:
        print(f"{out}: {len(made)} samples of {size[0]}x{size[1]}")


def _turns(text: str) -> tuple[float, float, float]:
    try:
        across, up, forward = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(
            f"'{text}' is not three angles such as 5,10,5", param_hint="--turn"
        ) from None
    return across, up, forward
