"""Reading text files line by line."""

from collections.abc import Iterator
from pathlib import Path

from laserimg.errors import LabelError, LaserImgError
from laserimg.files import read_bytes


def text_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield number and text of the lines that hold something, without surrounding spaces.

    Raises
    ------
    LabelError
        If the file cannot be read.
    """
    try:
        text = read_bytes(path).decode("utf-8-sig", errors="replace")
    except LaserImgError as error:
        raise LabelError(f"{path}: {error}") from None
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip():
            yield number, line.strip()
