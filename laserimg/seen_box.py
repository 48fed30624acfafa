"""What a rectangle in a grid shows by itself, before any region is looked for in it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SeenBox:
    """Size and shape of a rectangle of the grid in the world, at the range of what is near in it.

    Parameters
    ----------
    width, height : float or None
        Metres; None if nothing returned there.
    side_ratio : float
        How high one upright side is, in angle, as a share of the other; the higher one is 1. It is 1 on a
        grid of elevations and azimuths. At the ends of a tilting fan all rows meet in its axis: there a
        rectangle of the grid is a wedge.
    cut : frozenset of str
        Which of "width" and "height" end at the border of the grid: the object may be larger.
    """

    width: float | None
    height: float | None
    side_ratio: float
    cut: frozenset[str]
