"""Where captions of boxes go in a picture, so that none hides another."""

from collections.abc import Iterable, Iterator

Place = tuple[int, int, int, int]

# A caption is moved by at most so many times its height, up or down.
MOST_STEPS = 8


def caption_places(
    boxes: Iterable[tuple[float, float, float, float]],
    sizes: Iterable[tuple[int, int]],
    picture: tuple[int, int],
) -> list[Place]:
    """Return a place for each caption: over its box, else under it, else as near as those before it allow.

    Where all of that is taken a caption is put over its box.

    Parameters
    ----------
    boxes : iterable of (x, y, w, h)
        In pixels of the picture.
    sizes : iterable of (int, int)
        Width and height of each caption.
    picture : (int, int)
        Height and width.

    Returns
    -------
    list of (left, top, width, height)

    Examples
    --------
    >>> caption_places([(5, 40, 9, 9), (7, 41, 9, 9)], [(30, 10), (30, 10)], (100, 100))
    [(5, 30, 30, 10), (7, 50, 30, 10)]
    """
    taken: list[Place] = []
    for (x, y, _, h), (width, height) in zip(boxes, sizes, strict=True):
        left = min(max(0, round(x)), max(0, picture[1] - width))
        tops = [min(max(0, top), max(0, picture[0] - height)) for top in _tops(y, h, height)]
        free = (top for top in tops if not any(_meet((left, top, width, height), one) for one in taken))
        taken.append((left, next(free, tops[0]), width, height))
    return taken


def _tops(y: float, h: float, height: int) -> Iterator[int]:
    above, below = round(y) - height, round(y + h)
    for step in range(MOST_STEPS):
        yield above - step * height
        yield below + step * height


def _meet(a: Place, b: Place) -> bool:
    return a[0] < b[0] + b[2] and b[0] < a[0] + a[2] and a[1] < b[1] + b[3] and b[1] < a[1] + a[3]
