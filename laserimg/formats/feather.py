"""Feather tables, of which Argoverse 2 is made."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from laserimg.errors import MissingExtraError, ScanError
from laserimg.files import read_bytes

MAX_BYTES = 1 << 30
# Columns of words; all others that are read hold numbers.
TEXTS = ("sensor_name", "category")


def read_feather(path: Path, columns: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Return columns of a feather file as arrays.

    Raises
    ------
    ScanError
        If the file is no feather file, lacks a column, or has a gap in one.
    MissingExtraError
        Without pyarrow.
    """
    try:
        import pyarrow as pa
        from pyarrow import feather
    except ImportError:
        raise MissingExtraError("Argoverse feather files", "argoverse") from None
    data = read_bytes(path, MAX_BYTES)
    try:
        table = feather.read_table(io.BytesIO(data))
        table.validate(full=True)
        found = {name: table[name].to_numpy() for name in columns if name in table.column_names}
    except (pa.ArrowException, OSError, ValueError, KeyError) as error:
        raise ScanError(f"not a feather file: {' '.join(str(error).split())[:120]}") from error
    missing = [name for name in columns if name not in found]
    if missing:
        raise ScanError(f"has no column {' '.join(missing)}")
    wrong = [name for name, values in found.items() if values.dtype.kind not in "fiu" and name not in TEXTS]
    if wrong or any(table[name].null_count for name in columns):
        raise ScanError(f"a column holds no numbers or has gaps: {' '.join(wrong or columns)}")
    return found
