"""Reading compressed files as they are, and writing files whole or not at all."""

import bz2
import errno
import gzip
import hashlib
import lzma
import os
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

from laserimg.errors import LaserImgError

# A compressed file may claim any size; nothing a scanner writes comes near this.
MAX_UNPACKED_BYTES = 4 << 30
_BLOCK_BYTES = 16 << 20

_UNFINISHED = ".unfinished."

_OPENERS = {".bz2": bz2.open, ".gz": gzip.open, ".xz": lzma.open}


def stem(path: Path) -> str:
    """Return the file's name without its suffix and without a compression suffix.

    Examples
    --------
    >>> stem(Path("scans/room.1.dat.bz2"))
    'room.1'
    """
    return without_compression(path).stem


def without_compression(path: Path) -> Path:
    """Return the path without ``.bz2``, ``.gz`` or ``.xz`` at its end."""
    return path.with_suffix("") if path.suffix.lower() in _OPENERS else path


def read_bytes(path: Path, limit: int = MAX_UNPACKED_BYTES) -> bytes:
    """Return the contents of a file, unpacked if it ends in ``.bz2``, ``.gz`` or ``.xz``.

    Raises
    ------
    LaserImgError
        If the file is missing, unreadable, cut off, or unpacks to more than `limit` bytes.
    """
    data = read_start(path, limit + 1)
    if len(data) > limit:
        raise LaserImgError(f"holds more than {limit / (1 << 20):.3g} MB")
    return data


def read_start(path: Path, count: int) -> bytes:
    """Return the first `count` bytes of a file, unpacked if it is compressed; all, if it holds fewer.

    Raises
    ------
    LaserImgError
        If the file is missing, unreadable or cut off.
    """
    opener = _OPENERS.get(path.suffix.lower(), open)
    blocks, left = [], count
    try:
        with opener(path, "rb") as file:
            # A read makes room for as many bytes as it is asked for, whatever the file holds.
            while left > 0 and (block := file.read(min(left, _BLOCK_BYTES))):
                blocks.append(block)
                left -= len(block)
    except FileNotFoundError:
        raise LaserImgError("no such file") from None
    except (OSError, EOFError, lzma.LZMAError, zlib.error) as error:
        # The caller names the file.
        raise LaserImgError(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error
    return b"".join(blocks)


def changed_ns(path: Path) -> int:
    """Return when a file was last changed, in nanoseconds; 0 if there is none. Part of the key of a cache."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's contents in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@lru_cache(maxsize=4)
def sources_sha256(folder: Path) -> str:
    """Return the SHA-256 of all Python files in a folder: another one means another program."""
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*.py")):
        digest.update(f"{file.relative_to(folder).as_posix()} ".encode())
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`; it takes the name `path` only if the block succeeds.

    Examples
    --------
    >>> import tempfile
    >>> target = Path(tempfile.mkdtemp()) / "a.txt"
    >>> with atomic_write(target) as temporary:
    ...     _ = temporary.write_text("whole")
    >>> target.read_text()
    'whole'
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    # The suffix stays: cv2.imwrite and others choose the format by it.
    prefix = f"{_UNFINISHED}{path.stem}."
    temporary = None
    try:
        handle, name = tempfile.mkstemp(prefix=prefix, suffix=path.suffix, dir=path.parent)
        os.close(handle)
        temporary = Path(name)
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
    except OSError as error:
        # A full disk says so without saying where; others name the file that nobody asked for.
        if error.errno is None or (error.filename is not None and prefix not in str(error.filename)):
            raise
        raise type(error)(error.errno, error.strerror, str(path)) from error
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def remove_unfinished(folder: Path) -> None:
    """Remove what a killed process had half written in a folder that is one process's own."""
    for path in folder.glob(f"{_UNFINISHED}*"):
        path.unlink(missing_ok=True)


def is_hidden(path: Path) -> bool:
    """Return whether a name begins with a dot: half-written files, and what file managers leave behind."""
    return path.name.startswith(".")


def make_folder(path: Path) -> None:
    """Make a folder if it is not there, and be sure that files can be written into it.

    Raises
    ------
    OSError
        If not; before hours of work, not after.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except FileExistsError:
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path)) from None
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from None


def write_text(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
