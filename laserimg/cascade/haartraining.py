"""Old cascade files of opencv_haartraining, turned into the format of opencv_traincascade."""

from xml.etree.ElementTree import Element

from laserimg.cascade.xmlnodes import add, at, child, integer, integers, items, number
from laserimg.errors import ModelError


def is_old_format(cascade: Element) -> bool:
    """Whether a cascade element has the layout of opencv_haartraining."""
    return cascade.find("size") is not None and cascade.find("stageType") is None


def as_new_format(old: Element) -> Element:
    """Return the same cascade as opencv_traincascade would have written it.

    The values stay as they are, and the features keep their order, as in OpenCV's own conversion
    (``CascadeClassifier.convert``). Differs from it: a tree of stages is refused, where OpenCV
    silently runs the stages one after the other.

    Raises
    ------
    ModelError
        If something is missing or the stages are not a chain.
    """
    new = Element("cascade")
    size = integers(child(old, "size"))
    if len(size) != 2:
        raise ModelError(f"<size> must hold width and height, holds {len(size)} integers")
    add(new, "stageType", "BOOST")
    add(new, "featureType", "HAAR")
    add(new, "height", size[1])
    add(new, "width", size[0])
    add(add(new, "featureParams"), "maxCatCount", 0)
    stages, features = add(new, "stages"), Element("features")
    for index, stage in enumerate(items(old, "stages")):
        with at(f"stage {index}"):
            _add_stage(stages, features, stage, index)
    new.append(features)
    return new


def _add_stage(stages: Element, features: Element, old: Element, index: int) -> None:
    _check_chain(old, index)
    stage = add(stages, "_")
    add(stage, "stageThreshold", number(old, "stage_threshold"))
    weak = add(stage, "weakClassifiers")
    for position, tree in enumerate(items(old, "trees")):
        with at(f"tree {position}"):
            _add_tree(weak, features, tree.findall("_"))


def _check_chain(stage: Element, index: int) -> None:
    parent = integer(stage, "parent") if stage.find("parent") is not None else index - 1
    following = integer(stage, "next") if stage.find("next") is not None else -1
    if parent != index - 1 or following != -1:
        raise ModelError(
            f"a tree of stages (parent {parent}, next {following}) cannot be run; a chain of stages can"
        )


def _add_tree(weak: Element, features: Element, nodes: list[Element]) -> None:
    internal: list[object] = []
    leaves: list[object] = []
    for node in nodes:
        left = _follow(node, "left", leaves)
        right = _follow(node, "right", leaves)
        internal += [left, right, len(features), number(node, "threshold")]
        feature = add(features, "_")
        feature.extend(child(node, "feature"))
    tree = add(weak, "_")
    add(tree, "internalNodes", *internal)
    add(tree, "leafValues", *leaves)


def _follow(node: Element, side: str, leaves: list[object]) -> int:
    """Return where a side of a node leads: an index above 0, or minus the number of a new leaf."""
    if node.find(f"{side}_node") is not None:
        target = integer(node, f"{side}_node")
        if target < 1:  # the new format would take it for a leaf
            raise ModelError(f"<{side}_node> is {target}, but no node leads to the root")
        return target
    leaves.append(number(node, f"{side}_val"))
    return 1 - len(leaves)
