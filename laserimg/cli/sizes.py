"""Sizes as people write them."""

import typer


def window_of(text: str) -> tuple[int, int]:
    """Return width and height of ``24x32``; anything else is wrong usage."""
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) and int(height)):
        raise typer.BadParameter(
            f"'{text}' is not WIDTHxHEIGHT in pixels, such as 24x24", param_hint="--window"
        )
    return int(width), int(height)


def bytes_of(text: str) -> int:
    """Return the bytes of ``500M`` or ``2G``; anything else is wrong usage."""
    number, unit = text[:-1], text[-1:].upper()
    if unit not in ("M", "G") or not number.isdigit() or not int(number):
        raise typer.BadParameter(f"'{text}' is not a size such as 500M or 2G", param_hint="--memory")
    return int(number) << {"M": 20, "G": 30}[unit]
