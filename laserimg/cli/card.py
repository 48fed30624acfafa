"""``laserimg card``: write the card of a cascade."""

from pathlib import Path
from typing import Any

import typer

_IMAGES = (
    "range, reflectance, depth_relative, normals, normals_abs, normals_view, or a plane such as normals.r"
)


def card(
    cascade: Path = typer.Argument(..., metavar="NAME.xml", help="A Haar or LBP cascade."),
    label: str | None = typer.Option(None, "--class", help="The class that it finds."),
    image: str | None = typer.Option(None, help=f"The image that it looks at: {_IMAGES}."),
    object_size: str | None = typer.Option(
        None, metavar="WxH", help="Usual width and height of the object in metres, such as 0.25x0.36."
    ),
    margin: float | None = typer.Option(
        None, help="How far the window reaches over the object on every side, as a share of its size."
    ),
    trained_on: str | None = typer.Option(None, help="What it was trained on."),
    seed: int | None = typer.Option(None, help="Seed of its training."),
    licence: str | None = typer.Option(None, help="Licence of the cascade."),
    score: list[str] = typer.Option([], metavar="NAME=VALUE", help="A measured score; may be repeated."),
    quiet: bool = typer.Option(False, "--quiet", "-q", help="Print nothing when all is well."),
) -> None:
    """Write the card of a cascade: NAME.toml beside NAME.xml.

    The card tells what a detector is for, so that it runs without further options and, with the
    size of its object, looks only for windows that fit the range. Kind, window, stages and
    checksum are read from the cascade. When there is a card already, what is not given stays.

    \b
      laserimg card bin.xml --class bin --image normals_view
      laserimg card bin.xml --object-size 0.25x0.36 --margin 0.1 --score ap50=0.91
      laserimg card bin.xml                     (the cascade was trained again)
    """
    from dataclasses import replace

    from laserimg.cascade.xml import read_cascade_info
    from laserimg.formats.card import Card, card_path, card_text, file_sha256, read_card, write_card

    if cascade.suffix.lower() != ".xml":
        raise typer.BadParameter(f"'{cascade}' does not end in .xml", param_hint="NAME.xml")
    info = read_cascade_info(cascade)
    path = card_path(cascade)
    old = read_card(path) if path.exists() else None
    if old is None and (label is None or image is None):
        raise typer.BadParameter(f"a first card of {cascade} needs --class and --image")
    given: dict[str, Any] = {
        "label": label,
        "image": image,
        "object_size_m": _size(object_size),
        "margin": margin,
        "trained_on": trained_on,
        "seed": seed,
        "licence": licence,
        "scores": {**(old.scores if old else {}), **dict(map(_score, score))} if score else None,
    }
    read: dict[str, Any] = {
        "kind": info.kind,
        "window": info.window,
        "stages": info.stages,
        "sha256": file_sha256(cascade),
    }
    values = {name: value for name, value in {**given, **read}.items() if value is not None}
    new = replace(old, **values) if old else Card(**values)
    write_card(path, new)
    if not quiet:
        print(f"{path}\n\n{card_text(new)}", end="")


def _size(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        width, height = (float(part) for part in text.split("x"))
    except ValueError:
        raise typer.BadParameter(f"'{text}' is not WIDTHxHEIGHT in metres, such as 0.25x0.36") from None
    return width, height


def _score(text: str) -> tuple[str, float]:
    name, _, value = text.rpartition("=")
    try:
        return name, float(value)
    except ValueError:
        raise typer.BadParameter(f"'{text}' is not NAME=VALUE, such as ap50=0.91") from None
