"""Writing a cascade as the XML that every `cv2.CascadeClassifier` from OpenCV 2.4 to 5 reads."""

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.model import Cascade, Stage, Tree
from laserimg.cascade.stage import StageGoal
from laserimg.files import write_text

_BOOST = {"gentle": "GAB", "real": "RAB", "discrete": "DAB", "logit": "LB"}


def write_cascade(path: Path, cascade: Cascade, goal: StageGoal) -> None:
    """Write the XML whole or not at all."""
    write_text(path, cascade_xml(cascade, goal))


def cascade_xml(cascade: Cascade, goal: StageGoal) -> str:
    """Return the XML of a cascade; it lists the features used and no others.

    Thresholds and leaves are printed with nine significant digits, from which a float32 is read back exactly.
    `goal` is for people and for opencv_traincascade; the detector does not read it.
    """
    used = np.unique(np.concatenate([stage.features for stage in cascade.stages] or [np.empty(0, np.int64)]))
    out = io.StringIO()
    out.write('<?xml version="1.0"?>\n<opencv_storage>\n<cascade>\n')
    out.write(_head(cascade, goal))
    out.write("  <stages>\n")
    for stage in cascade.stages:
        out.write(_stage(stage, used, cascade.pool.mode == "lbp"))
    out.write("  </stages>\n  <features>\n")
    out.write(_features(cascade, used))
    out.write("  </features>\n</cascade>\n</opencv_storage>\n")
    return out.getvalue()


def _head(cascade: Cascade, goal: StageGoal) -> str:
    pool, lbp = cascade.pool, cascade.pool.mode == "lbp"
    longest = max((len(stage.trees) for stage in cascade.stages), default=0)
    mode = "" if lbp else f"<mode>{pool.mode.upper()}</mode>"
    return (
        "  <stageType>BOOST</stageType>\n"
        f"  <featureType>{'LBP' if lbp else 'HAAR'}</featureType>\n"
        f"  <height>{pool.height}</height>\n  <width>{pool.width}</width>\n"
        "  <stageParams>\n"
        f"    <boostType>{_BOOST[goal.boost]}</boostType>\n"
        f"    <minHitRate>{goal.min_hit_rate:.8e}</minHitRate>\n"
        f"    <maxFalseAlarm>{goal.max_false_alarm:.8e}</maxFalseAlarm>\n"
        f"    <weightTrimRate>{goal.trim:.8e}</weightTrimRate>\n"
        f"    <maxDepth>{goal.depth}</maxDepth>\n    <maxWeakCount>{longest}</maxWeakCount></stageParams>\n"
        "  <featureParams>\n"
        f"    <maxCatCount>{256 if lbp else 0}</maxCatCount>\n"
        f"    <featSize>1</featSize>{mode}</featureParams>\n"
        f"  <stageNum>{len(cascade)}</stageNum>\n"
    )


def _stage(stage: Stage, used: NDArray[np.int64], lbp: bool) -> str:
    trees = "".join(_tree(tree, used, lbp) for tree in stage.trees)
    return (
        f"    <_>\n      <maxWeakCount>{len(stage.trees)}</maxWeakCount>\n"
        f"      <stageThreshold>{stage.threshold:.8e}</stageThreshold>\n"
        f"      <weakClassifiers>\n{trees}      </weakClassifiers></_>\n"
    )


def _tree(tree: Tree, used: NDArray[np.int64], lbp: bool) -> str:
    words = []
    for node, feature in enumerate(np.searchsorted(used, tree.features)):
        left, right = tree.children[node]
        question = " ".join(map(str, tree.subsets[node])) if lbp else f"{tree.thresholds[node]:.8e}"
        words.append(f"{left} {right} {feature} {question}")
    leaves = " ".join(f"{leaf:.8e}" for leaf in tree.leaves)
    return (
        f"        <_>\n          <internalNodes>\n            {' '.join(words)}</internalNodes>\n"
        f"          <leafValues>\n            {leaves}</leafValues></_>\n"
    )


def _features(cascade: Cascade, used: NDArray[np.int64]) -> str:
    features = cascade.pool[used]
    text = []
    for rects, weights, tilted in zip(features.rects, features.weights, features.tilted, strict=True):
        if cascade.pool.mode == "lbp":
            text.append(f"    <_>\n      <rect>\n        {_words(rects[0])}</rect></_>\n")
            continue
        lines = [
            f"        <_>\n          {_words(rect)} {weight:g}.</_>\n"
            for rect, weight in zip(rects, weights, strict=True)
            if weight
        ]
        text.append(
            f"    <_>\n      <rects>\n{''.join(lines)}      </rects>\n      <tilted>{tilted:d}</tilted></_>\n"
        )
    return "".join(text)


def _words(values: NDArray) -> str:
    return " ".join(map(str, values.tolist()))
