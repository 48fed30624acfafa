"""Work on a grid by blocks of rows: small enough for the cache, on as many threads as cv2 may use."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import cv2

BLOCK_PIXELS = 1 << 17


def by_row_blocks(
    work: Callable[[slice], None], shape: tuple[int, int], multiple: int = 1, pixels: int = BLOCK_PIXELS
) -> None:
    """Call `work` with slices of rows that cover a grid; it must write each row's result for itself.

    NumPy and cv2 release the interpreter's lock in their loops, so threads share the work. The
    blocks depend on the shape alone, and the result not on the number of threads, which is
    ``cv2.getNumThreads()``: 1 in workers of parallel runs.

    Parameters
    ----------
    work : callable
    shape : (rows, columns)
    multiple : int
        Every block but the last has a multiple of this many rows.
    pixels : int
        Elements of the grid in a block, about.

    Examples
    --------
    >>> blocks = []
    >>> by_row_blocks(blocks.append, (5, 1 << 17), multiple=2)
    >>> sorted(blocks, key=lambda rows: rows.start)
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    rows, columns = shape
    count = max(1, round(rows * columns / pixels))
    step = max(1, -(-rows // (count * multiple))) * multiple
    blocks = [slice(first, min(first + step, rows)) for first in range(0, rows, step)]
    threads = min(cv2.getNumThreads(), len(blocks))
    if threads <= 1:
        for block in blocks:
            work(block)
        return
    with ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(work, block) for block in blocks]:
            done.result()
