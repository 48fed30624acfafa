"""Numbers out of text, checked line by line."""

import io
import warnings

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ScanError


def read_table(
    lines: io.BytesIO, rows: int | None = None, delimiter: str | None = None
) -> NDArray[np.float64]:
    """Return the next lines as rows of numbers; every line must have as many.

    Parameters
    ----------
    lines : binary file
        Is left behind the last line read.
    rows : int, optional
        Take so many lines, else all that are left.

    Raises
    ------
    ScanError
        If a line holds something else, or too few numbers.
    """
    try:
        with warnings.catch_warnings():
            # "No data" is an error here, below.
            warnings.simplefilter("ignore", UserWarning)
            table = np.loadtxt(lines, ndmin=2, max_rows=rows, delimiter=delimiter, encoding="latin1")
    except (ValueError, UnicodeDecodeError) as error:
        raise ScanError(f"not a table of numbers: {_first_line(error)}") from error
    if not table.size:
        raise ScanError("holds no points")
    if rows is not None and len(table) < rows:
        raise ScanError(f"is cut off: {len(table)} of {rows} points")
    return table


def _first_line(error: Exception) -> str:
    # What follows the semicolon is advice for callers of numpy.
    return str(error).partition("\n")[0].partition(";")[0][:120]
