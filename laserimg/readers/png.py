"""A look at a PNG file before a decoder sees it: decoders print on stderr what they do not like."""

import struct
import zlib
from collections.abc import Iterator

from laserimg.errors import ScanError
from laserimg.scan import MAX_PIXELS

SIGNATURE = b"\x89PNG\r\n\x1a\n"
# Bits, colour type, compression, filter method, interlace method.
_GREY_16_BIT = [16, 0, 0, 0, 0]
_FILTERS = 5
# Deflate packs at most 1032 bytes into one.
_MAX_PACKING = 1032


def check_png(data: bytes) -> None:
    """Check that a PNG file is whole and holds one channel of 16 bits.

    Raises
    ------
    ScanError
        If it is cut off, damaged, or another kind of image.
    """
    chunks = _chunks(data)
    kind, header = next(chunks, (b"", b""))
    if kind != b"IHDR" or len(header) != 13:
        raise ScanError("not a readable PNG file")
    width, height, *kind_of_pixels = struct.unpack(">IIBBBBB", header)
    if kind_of_pixels != _GREY_16_BIT:
        raise ScanError("must be a PNG of 16 bits, one channel, not interlaced")
    row_bytes = 1 + 2 * width
    if width * height > MAX_PIXELS or height * row_bytes > len(data) * _MAX_PACKING:
        raise ScanError(f"is cut off: the header says {height} x {width} pixels")
    _check_rows(b"".join(body for kind, body in chunks if kind == b"IDAT"), height, row_bytes)


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = len(SIGNATURE)
    kind = b""
    while kind != b"IEND":
        if at + 12 > len(data):
            raise ScanError("is cut off")
        (size,) = struct.unpack_from(">I", data, at)
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + size]
        if at + 12 + size > len(data):
            raise ScanError("is cut off")
        if zlib.crc32(kind + body) != struct.unpack_from(">I", data, at + 8 + size)[0]:
            raise ScanError("is damaged: a checksum does not hold")
        if kind not in (b"IHDR", b"IDAT", b"IEND") and not kind[:1].islower():
            raise ScanError("not a readable PNG file")
        # Ancillary chunks (text, times, colours) change no values; a decoder may stumble over them.
        yield kind, body
        at += 12 + size


def _check_rows(packed: bytes, height: int, row_bytes: int) -> None:
    unpacker = zlib.decompressobj()
    try:
        rows = unpacker.decompress(packed, height * row_bytes)
    except zlib.error as error:
        raise ScanError(f"is damaged: {error}") from error
    if len(rows) != height * row_bytes:
        raise ScanError("is cut off: rows are missing")
    if max(rows[::row_bytes]) >= _FILTERS:
        raise ScanError("is damaged: unknown filter")
