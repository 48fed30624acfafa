"""The colours of a map: those of paper 1, figure 4."""

from collections.abc import Mapping
from types import MappingProxyType

from laserimg.classify.scores import UNKNOWN

GROUND = "ground"
UNDERSEGMENTED = "undersegmented"
# Returns of no cluster: too few hold together.
LOOSE = "loose"

Colour = tuple[int, int, int]

# "Building:Brown, Car: Yellow, Human:Blue, Tree:Green, Pole:Red, White:The ground and under-segmented
# clusters." The shades are ours, and so is gray for what the classifier leaves open.
COLOURS: Mapping[str, Colour] = MappingProxyType(
    {
        "building": (176, 112, 60),
        "car": (255, 214, 10),
        "person": (45, 110, 255),
        "tree": (52, 178, 74),
        "pole": (235, 52, 48),
        # What was learnt as none of these: street furniture, fences, bicycles, lorries.
        "other": (170, 150, 185),
        UNKNOWN: (128, 132, 140),
        UNDERSEGMENTED: (250, 240, 250),
        GROUND: (236, 236, 232),
        LOOSE: (92, 95, 102),
    }
)
_MORE = ((0, 180, 190), (190, 90, 220), (255, 140, 0), (120, 200, 20), (240, 110, 160), (120, 120, 255))


# What others call a class of the paper, and what the paper calls ours.
_ALSO = {"human": "person", "pedestrian": "person"}
_TAIL = (UNKNOWN, UNDERSEGMENTED, GROUND, LOOSE)


def palette(labels: tuple[str, ...]) -> dict[str, Colour]:
    """Return a colour for every class of a map, also for those that the paper does not have.

    Examples
    --------
    >>> palette(("Human", "sheep"))["Human"] == COLOURS["person"], palette(("Human", "sheep"))["sheep"]
    (True, (0, 180, 190))
    """
    known = {label: _known(label) for label in labels if label not in _TAIL}
    order = list(COLOURS)
    ours = sorted((label for label in known if known[label]), key=lambda label: order.index(known[label]))
    others = [label for label in known if not known[label]]
    more = {label: _MORE[place % len(_MORE)] for place, label in enumerate(others)}
    colours = {label: COLOURS[known[label]] for label in ours}
    return {**colours, **more, **{label: COLOURS[label] for label in _TAIL}}


def _known(label: str) -> str:
    """Return the class of the paper that a label means, "" if none."""
    small = label.lower()
    small = _ALSO.get(small, small)
    return small if small in COLOURS and small not in _TAIL else ""
