"""Small detectors for tests: a cascade of one feature that finds squares, and a HOG that finds discs."""

from functools import cache

import cv2
import numpy as np
from sklearn.svm import LinearSVC

from laserimg.cascade.xml import check_cascade
from laserimg.detectors.cascade import CascadeModel
from laserimg.detectors.hog import HogModel, load_hog, save_hog
from laserimg.formats.card import Card

DIGEST = "0" * 64


def cascade_xml(stages, features, window=(24, 24), kind="HAAR"):
    """A cascade of stumps: stages of (threshold, [(nodes, leaves), ...]) on features in XML."""

    def listed(tag, entries):
        return f"<{tag}>{''.join(f'<_>{entry}</_>' for entry in entries)}</{tag}>"

    def tree(nodes, leaves):
        return f"<internalNodes>{nodes}</internalNodes><leafValues>{leaves}</leafValues>"

    def stage(threshold, trees):
        weak = listed("weakClassifiers", [tree(*one) for one in trees])
        return f"<stageThreshold>{threshold}</stageThreshold>{weak}"

    return (
        f'<?xml version="1.0"?><opencv_storage><cascade><stageType>BOOST</stageType>'
        f"<featureType>{kind}</featureType><height>{window[1]}</height><width>{window[0]}</width>"
        f"<featureParams><maxCatCount>{0 if kind == 'HAAR' else 256}</maxCatCount></featureParams>"
        f"{listed('stages', [stage(*one) for one in stages])}{listed('features', features)}"
        "</cascade></opencv_storage>"
    ).encode()


def haar(*rectangles):
    return f"<rects>{''.join(f'<_>{one}</_>' for one in rectangles)}</rects><tilted>0</tilted>"


def classifier_of(xml):
    storage = cv2.FileStorage(check_cascade(xml)[1], cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    classifier = cv2.CascadeClassifier()
    assert classifier.read(storage.getFirstTopLevelNode())
    return classifier


def cascade_model(xml, **card):
    info = check_cascade(xml)[0]
    known = {"label": "thing", "kind": info.kind, "image": "range", "window": info.window, "sha256": DIGEST}
    return CascadeModel("by_hand", Card(**(known | card)), classifier_of(xml), info.last_threshold)


def blob_xml(window=(24, 24), bright=True, likeness=0.85):
    """A cascade that fires where the middle of a window, half its sides, stands out from the rest as a whole.

    Its feature is the middle less a quarter of the window; a rectangle that fills the middle exactly gives
    the most, `likeness` is the share of it that is asked for.
    """
    w, h = window
    feature = haar(f"0 0 {w} {h} -1", f"{w // 4} {h // 4} {w // 2} {h // 2} 4")
    inner = np.zeros((h, w))
    inner[h // 4 : h // 4 + h // 2, w // 4 : w // 4 + w // 2] = 1
    most = (4 * inner.sum() - inner.sum()) / ((w - 2) * (h - 2) * inner[1:-1, 1:-1].std())
    sign = 1 if bright else -1
    leaves = "-1 1" if bright else "1 -1"
    return cascade_xml([(0, [(f"0 -1 0 {sign * likeness * most}", leaves)])], [feature], window)


def blob_model(window=(24, 24), bright=True, likeness=0.85, **card):
    """The model of `blob_xml`: the square is the object, the rest is margin."""
    return cascade_model(blob_xml(window, bright, likeness), **({"margin": 0.5} | card))


HOG = {
    "winSize": (32, 32),
    "blockSize": (8, 8),
    "blockStride": (4, 4),
    "cellSize": (4, 4),
    "nbins": 9,
    "derivAperture": 1,
    "winSigma": -1.0,
    "histogramNormType": 0,
    "L2HysThreshold": 0.2,
    "gammaCorrection": False,
    "nlevels": 64,
    "signedGradient": False,
}


def disc_patch(rng, radius, shift=(0.0, 0.0), side=32):
    """A disc that is darker than the ground, both noisy."""
    y, x = np.mgrid[:side, :side] - (side - 1) / 2
    inside = np.hypot(x - shift[0], y - shift[1]) <= radius
    dark, bright = rng.uniform(20, 90), rng.uniform(140, 240)
    patch = np.where(inside, dark, bright) + rng.normal(0, 4, (side, side))
    return np.clip(cv2.GaussianBlur(patch, (3, 3), 0), 0, 255).astype(np.uint8)


def other_patch(rng, side=32):
    """No centred disc: a disc of another size or place, an edge, a bar, or noise."""
    choice = rng.integers(4)
    if choice == 0:
        return disc_patch(rng, rng.choice([4.0, 6.0, 15.0, 18.0]), rng.uniform(-2, 2, 2), side)
    if choice == 1:
        angle = rng.uniform(0, 2 * np.pi)
        return disc_patch(rng, 10, rng.uniform(5, 14) * np.array([np.cos(angle), np.sin(angle)]), side)
    patch = np.full((side, side), rng.uniform(0, 255))
    if choice == 2:
        patch[rng.integers(side) :] = rng.uniform(0, 255)
        patch = patch.T if rng.integers(2) else patch
    return np.clip(patch + rng.normal(0, 4, (side, side)), 0, 255).astype(np.uint8)


@cache
def disc_hog():
    """Contents of a HOG file that finds discs of radius 10 in windows of 32 pixels."""
    rng = np.random.default_rng(0)
    discs = [disc_patch(rng, rng.uniform(9.2, 10.8), rng.uniform(-1, 1, 2)) for _ in range(300)]
    others = [other_patch(rng) for _ in range(1500)]
    descriptor = cv2.HOGDescriptor(*HOG.values())
    features = np.array([descriptor.compute(patch).ravel() for patch in discs + others])
    svm = LinearSVC(C=0.1).fit(features, np.repeat([1, 0], [len(discs), len(others)]))
    return save_hog(HOG, svm.coef_.ravel(), float(svm.intercept_[0]))


def hog_model(folder, **card):
    path = folder / "disc.npz"
    path.write_bytes(disc_hog())
    known = {"label": "ball", "kind": "hog", "image": "range", "window": (32, 32), "sha256": DIGEST}
    # The disc has 20 of the 32 pixels.
    return HogModel("disc", Card(**(known | {"margin": 0.3} | card)), load_hog(path))
