"""Cascade XML files, checked before OpenCV reads them.

OpenCV trusts a cascade file: an index outside its list reads foreign memory (opencv issue 15125),
a tree with a loop never ends, a missing file loads as nothing. So OpenCV is never given the file.
It is parsed here, every number is checked, and OpenCV reads an XML written anew from the checked
values; old files of opencv_haartraining are converted on the way.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal
from xml.etree.ElementTree import Element, ParseError, tostring

from laserimg.cascade.haartraining import as_new_format, is_old_format
from laserimg.cascade.xmlnodes import (
    add,
    as_integer,
    as_number,
    at,
    child,
    integer,
    integers,
    items,
    number,
    numbers,
    word,
)
from laserimg.errors import LaserImgError, ModelError
from laserimg.files import read_bytes

if TYPE_CHECKING:
    import cv2

Kind = Literal["haar", "lbp"]
Window = tuple[int, int]

# The largest cascade that OpenCV ever shipped has 2.7 MB, its widest window 64 pixels.
MAX_BYTES = 64 << 20
MIN_WINDOW, MAX_WINDOW = 3, 4096
MAX_RECTANGLES = 3
# Ordered values for Haar; for LBP 256 categories, in 8 integers of 32 bits a node.
CATEGORIES = {"haar": 0, "lbp": 256}
NODE_LENGTH = {"haar": 4, "lbp": 11}
PIP_LINE = 'pip install --force-reinstall "opencv-contrib-python-headless>=4.10,<6"'


@dataclass(frozen=True, slots=True)
class CascadeInfo:
    """What a cascade file holds.

    Parameters
    ----------
    kind : "haar" or "lbp"
    window : (int, int)
        Width and height of the window in pixels.
    stages, weak_count, features : int
        Numbers of stages, of weak classifiers in all stages, and of features.
    last_threshold : float
        What the sum of the last stage must reach.
    """

    kind: Kind
    window: Window
    stages: int
    weak_count: int
    features: int
    last_threshold: float


def read_cascade_info(path: Path) -> CascadeInfo:
    """Return what a cascade file holds, after checking all of it.

    Raises
    ------
    ModelError
        If the file cannot be read, or OpenCV could not run it safely.
    """
    return _read(path)[0]


def load_cascade(path: Path) -> "cv2.CascadeClassifier":
    """Load a Haar or LBP cascade, in the format of opencv_traincascade or opencv_haartraining.

    Raises
    ------
    ModelError
        If the file cannot be read, OpenCV could not run it safely, or this OpenCV has no
        cascade detector.
    """
    import cv2

    if not hasattr(cv2, "CascadeClassifier"):
        raise ModelError(f"this OpenCV ({cv2.__version__}) has no CascadeClassifier: {PIP_LINE}")
    text = _read(path)[1]
    storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    cascade = cv2.CascadeClassifier()
    if not cascade.read(storage.getFirstTopLevelNode()) or cascade.empty():
        raise ModelError(f"{path}: OpenCV {cv2.__version__} refuses this cascade")
    return cascade


def _read(path: Path) -> tuple[CascadeInfo, str]:
    with at(str(path)):
        try:
            data = read_bytes(path, MAX_BYTES)
        except LaserImgError as error:
            raise ModelError(str(error)) from None
        return check_cascade(data)


def check_cascade(data: bytes) -> tuple[CascadeInfo, str]:
    """Return what a cascade file holds, and its XML written anew from the checked values.

    The format: left and right child, feature and threshold (LBP: 8 integers) a node; a child
    above 0 is a node of the same tree, others are minus the number of a leaf; node 0 is the root.

    Raises
    ------
    ModelError
        If a part is missing, a number is not finite or out of its range, a child or feature does
        not exist, a tree has a loop, or a rectangle leaves the window.
    """
    cascade = _parse(data)
    if is_old_format(cascade):
        cascade = as_new_format(cascade)
    kind = _kind(cascade)
    window = _window(cascade)
    features = items(cascade, "features")
    stages = items(cascade, "stages")
    clean = Element("cascade")
    # Asked for weights, OpenCV takes windows without contrast for hits of a single stage, not of two.
    twice = 2 if len(stages) == 1 else 1
    _write_head(clean, kind, window, len(stages) * twice)
    weak_count = _copy_stages(clean, stages * twice, kind, len(features)) // twice
    _copy_features(clean, features, kind, window)
    last_threshold = number(stages[-1], "stageThreshold")
    info = CascadeInfo(kind, window, len(stages), weak_count, len(features), last_threshold)
    storage = Element("opencv_storage")
    storage.append(clean)
    return info, '<?xml version="1.0"?>\n' + tostring(storage, encoding="unicode")


def _parse(data: bytes) -> Element:
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import fromstring

    try:
        root = fromstring(data, forbid_dtd=True)
    except ParseError as error:
        raise ModelError(f"not an XML file: {error}") from None
    except DefusedXmlException:
        raise ModelError("holds a document type or entities, which no cascade needs") from None
    except (LookupError, ValueError) as error:
        raise ModelError(f"unknown text encoding: {error}") from None
    if root.tag != "opencv_storage" or len(root) == 0:
        raise ModelError("not a cascade: the file does not begin with <opencv_storage>")
    return root[0]


def _kind(cascade: Element) -> Kind:
    if word(cascade, "stageType") != "BOOST":
        raise ModelError("not a cascade: <stageType> is not BOOST")
    named = word(cascade, "featureType")
    if named not in ("HAAR", "LBP"):
        raise ModelError(f"features of the type '{named[:20]}' cannot be run; HAAR and LBP can")
    kind: Kind = "haar" if named == "HAAR" else "lbp"
    categories = integer(child(cascade, "featureParams"), "maxCatCount")
    if categories != CATEGORIES[kind]:
        raise ModelError(f"<maxCatCount> is {categories}, {named} needs {CATEGORIES[kind]}")
    return kind


def _window(cascade: Element) -> Window:
    width, height = integer(cascade, "width"), integer(cascade, "height")
    if not (MIN_WINDOW <= width <= MAX_WINDOW and MIN_WINDOW <= height <= MAX_WINDOW):
        raise ModelError(f"the window is {width}x{height}, allowed are {MIN_WINDOW} to {MAX_WINDOW} pixels")
    return width, height


def _write_head(clean: Element, kind: Kind, window: Window, stages: int) -> None:
    add(clean, "stageType", "BOOST")
    add(clean, "featureType", kind.upper())
    add(clean, "height", window[1])
    add(clean, "width", window[0])
    add(add(clean, "featureParams"), "maxCatCount", CATEGORIES[kind])
    add(clean, "stageNum", stages)


def _copy_stages(clean: Element, stages: list[Element], kind: Kind, features: int) -> int:
    """Append the checked stages and return their number of weak classifiers."""
    target, weak_count = add(clean, "stages"), 0
    for index, stage in enumerate(stages):
        with at(f"stage {index}"):
            trees = items(stage, "weakClassifiers")
            copy = add(target, "_")
            add(copy, "maxWeakCount", len(trees))
            add(copy, "stageThreshold", number(stage, "stageThreshold"))
            weak = add(copy, "weakClassifiers")
            for position, tree in enumerate(trees):
                with at(f"weak classifier {position}"):
                    _copy_tree(weak, tree, kind, features)
            weak_count += len(trees)
    return weak_count


def _copy_tree(weak: Element, tree: Element, kind: Kind, features: int) -> None:
    nodes = _nodes(child(tree, "internalNodes"), kind)
    leaves = numbers(child(tree, "leafValues"))
    if len(leaves) != len(nodes) + 1:
        raise ModelError(f"{len(nodes)} nodes need {len(nodes) + 1} leaf values, there are {len(leaves)}")
    for index, (left, right, feature) in enumerate(node[:3] for node in nodes):
        _check_node(index, (int(left), int(right)), len(nodes))
        if not 0 <= feature < features:
            raise ModelError(f"feature {feature} does not exist, there are {features}")
    copy = add(weak, "_")
    add(copy, "internalNodes", *(value for node in nodes for value in node))
    add(copy, "leafValues", *leaves)


def _nodes(element: Element, kind: Kind) -> list[Sequence[float]]:
    tokens, length = (element.text or "").split(), NODE_LENGTH[kind]
    if not tokens or len(tokens) % length:
        raise ModelError(f"<internalNodes> must hold {length} numbers a node, holds {len(tokens)}")
    return [_node(tokens[start : start + length], kind) for start in range(0, len(tokens), length)]


def _node(tokens: list[str], kind: Kind) -> Sequence[float]:
    if kind == "lbp":
        return [as_integer(token, "internalNodes") for token in tokens]
    head = [as_integer(token, "internalNodes") for token in tokens[:3]]
    return [*head, as_number(tokens[3], "internalNodes")]


def _check_node(index: int, children: tuple[int, int], nodes: int) -> None:
    # OpenCV runs a cascade of single-node trees without looking at their children.
    if nodes == 1 and children != (0, -1):
        raise ModelError(f"a single node must lead to leaves '0 -1', not '{children[0]} {children[1]}'")
    for target in children:
        # Writers number the nodes from the root down; anything else could be a loop.
        if target > 0 and not index < target < nodes:
            raise ModelError(f"node {index} leads to node {target}, allowed are {index + 1} to {nodes - 1}")
        if -target > nodes:
            raise ModelError(f"node {index} leads to leaf {-target}, the last is {nodes}")


def _copy_features(clean: Element, features: list[Element], kind: Kind, window: Window) -> None:
    target, copy = add(clean, "features"), _copy_haar if kind == "haar" else _copy_lbp
    for index, feature in enumerate(features):
        with at(f"feature {index}"):
            copy(add(target, "_"), feature, window)


def _copy_haar(copy: Element, feature: Element, window: Window) -> None:
    tilted = integer(feature, "tilted") if feature.find("tilted") is not None else 0
    if tilted not in (0, 1):
        raise ModelError(f"<tilted> must be 0 or 1, is {tilted}")
    rectangles = items(feature, "rects")
    if len(rectangles) > MAX_RECTANGLES:
        raise ModelError(f"{len(rectangles)} rectangles, OpenCV takes {MAX_RECTANGLES}")
    target = add(copy, "rects")
    for rectangle in rectangles:
        add(target, "_", *_haar_rectangle(rectangle, bool(tilted), window))
    add(copy, "tilted", tilted)


def _haar_rectangle(element: Element, tilted: bool, window: Window) -> list[float]:
    tokens = (element.text or "").split()
    if len(tokens) != 5:
        raise ModelError(f"a rectangle is x y w h weight, this has {len(tokens)} numbers")
    x, y, w, h = (as_integer(token, "rects") for token in tokens[:4])
    # (x, y) is the top corner of a tilted rectangle: w runs down to the right, h down to the left.
    extent = (x - h, y, w + h, w + h) if tilted else (x, y, w, h)
    _check_inside((w, h), extent, window)
    return [x, y, w, h, as_number(tokens[4], "rects")]


def _copy_lbp(copy: Element, feature: Element, window: Window) -> None:
    cell = integers(child(feature, "rect"))
    if len(cell) != 4:
        raise ModelError(f"<rect> must hold 4 integers, holds {len(cell)}")
    x, y, w, h = cell
    # The rectangle is one cell of 3 x 3.
    _check_inside((w, h), (x, y, 3 * w, 3 * h), window)
    add(copy, "rect", *cell)


def _check_inside(size: tuple[int, int], extent: Sequence[int], window: Window) -> None:
    x, y, w, h = extent
    if min(size) < 1 or x < 0 or y < 0 or x + w > window[0] or y + h > window[1]:
        raise ModelError(
            f"covers x {x} to {x + w}, y {y} to {y + h}, not a part of the {window[0]}x{window[1]} window"
        )
