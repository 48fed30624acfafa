"""PCD records with padding fields ``_``, made plain so that every reader takes them."""

import numpy as np

from laserimg.errors import ScanError

_PAD = "_"
_BINARY = b"\nDATA binary\n"
# PCL's points keep x, y, z in 16 bytes (PCL_ADD_POINT4D).
_XYZ_BYTES = 16
_MAX_HEADER_BYTES = 1 << 14
_KINDS = {"F": "f", "I": "i", "U": "u"}


def without_padding(data: bytes) -> bytes:
    """Return a PCD file without its padding; other files as they are.

    PCL writes the gaps of its structs as fields ``_``. Where one has COUNT 0, the widths of the gaps are
    not to be trusted, only the length of the whole record (SUSTech POINTS: 48 bytes, timestamp at 24 and
    ring at 32, where the header leads to 20 and 34): then the fields stand as in the C struct, each at a
    multiple of its size behind the 16 bytes of x, y, z.

    Raises
    ------
    ScanError
        If the header is malformed or the records are cut off.
    """
    text, mark, _ = data[:_MAX_HEADER_BYTES].partition(_BINARY)
    header = _header(text)
    if not mark or _PAD not in header.get("FIELDS", []):
        return data
    try:
        record, points = _record(header), int(header["POINTS"][0])
    except (KeyError, IndexError, ValueError, TypeError, ArithmeticError):
        raise ScanError(
            "not a PCD header: FIELDS, SIZE, TYPE, COUNT and POINTS do not fit each other"
        ) from None
    body = data[len(text) + len(mark) :]
    if points < 0 or len(body) < points * record.itemsize:
        raise ScanError(f"is cut off: the header says {points} points of {record.itemsize} bytes")
    padded = np.frombuffer(body, record, count=points)
    plain = np.empty(points, [(name, record[name]) for name in record.names or ()])
    for name in record.names or ():
        plain[name] = padded[name]
    return _plain_header(header) + plain.tobytes()


def _header(text: bytes) -> dict[str, list[str]]:
    lines = (line.split() for line in text.decode("ascii", "replace").splitlines())
    return {line[0]: line[1:] for line in lines if line and not line[0].startswith("#")}


def _record(header: dict[str, list[str]]) -> np.dtype:
    """The fields that are no padding, with their offsets in the record."""
    names, kinds = header["FIELDS"], [_KINDS[kind] for kind in header["TYPE"]]
    sizes, counts = ([int(value) for value in header[key]] for key in ("SIZE", "COUNT"))
    shares = [size * count for size, count in zip(sizes, counts, strict=True)]
    kept = [k for k, name in enumerate(names) if name != _PAD]
    if len(names) != len(shares) or min(shares) < 0 or any(counts[k] != 1 for k in kept):
        raise ValueError
    misleading = 0 in counts
    offsets = _struct_offsets([sizes[k] for k in kept]) if misleading else [sum(shares[:k]) for k in kept]
    return np.dtype(
        {
            "names": [names[k] for k in kept],
            "formats": [f"<{kinds[k]}{sizes[k]}" for k in kept],
            "offsets": offsets,
            "itemsize": sum(shares),
        }
    )


def _struct_offsets(sizes: list[int]) -> list[int]:
    offsets, at = [], 0
    for number, size in enumerate(sizes):
        at = max(at, _XYZ_BYTES) if number >= 3 else at
        at += -at % size
        offsets.append(at)
        at += size
    return offsets


def _plain_header(header: dict[str, list[str]]) -> bytes:
    kept = [k for k, name in enumerate(header["FIELDS"]) if name != _PAD]
    columns = {key: [header[key][k] for k in kept] for key in ("FIELDS", "SIZE", "TYPE", "COUNT")}
    lines = [f"{key} {' '.join(values)}" for key, values in (header | columns).items()]
    return "\n".join(lines).encode() + _BINARY
