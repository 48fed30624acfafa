"""Cascade files: what is safe loads and detects as OpenCV does; what is not is refused."""

import os
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laserimg.cascade.xml import CascadeInfo, check_cascade, load_cascade, read_cascade_info
from laserimg.errors import ModelError

REFERENCE = Path(__file__).parents[2] / "shared" / "reference" / "opencv_traincascade"


def list_of(tag: str, entries: list[str]) -> str:
    return f"<{tag}>{''.join(f'<_>{entry}</_>' for entry in entries)}</{tag}>"


def tree(nodes: str, leaves: str) -> str:
    return f"<internalNodes>{nodes}</internalNodes><leafValues>{leaves}</leafValues>"


def stage(trees: list[str], threshold: float = -0.5) -> str:
    return f"<stageThreshold>{threshold}</stageThreshold>{list_of('weakClassifiers', trees)}"


def haar(rectangles: list[str], tilted: int = 0) -> str:
    return f"{list_of('rects', rectangles)}<tilted>{tilted}</tilted>"


def cascade(stages: list[str], features: list[str], kind: str = "HAAR", window: str = "12 10") -> bytes:
    width, height = window.split()
    categories = 0 if kind == "HAAR" else 256
    return (
        '<?xml version="1.0"?><opencv_storage><!-- by hand --><cascade>'
        f"<stageType>BOOST</stageType><featureType>{kind}</featureType>"
        f"<height>{height}</height><width>{width}</width>"
        f"<featureParams><maxCatCount>{categories}</maxCatCount></featureParams>"
        f"{list_of('stages', stages)}{list_of('features', features)}</cascade></opencv_storage>"
    ).encode()


UPRIGHT = haar(["1 1 6 4 -1.", "1 1 3 4 2."])
TILTED = haar(["6 0 4 5 -1", "6 0 2 5 3"], tilted=1)
THREE = haar(["0 0 12 10 -1", "4 0 4 10 1.5", "4 2 4 2 .5e0"])
STUMPS = cascade(
    [
        stage([tree("0 -1 0 1e-2", "-.4 0.6"), tree("0 -1 1 -0.02", "0.5 -0.5")]),
        stage([tree("0 -1 2 0", "-0.4 0.7")], -1),
    ],
    [UPRIGHT, TILTED, THREE],
)
TREES = cascade(
    [stage([tree("2 1 0 0.01 0 -1 1 -0.02 -2 -3 2 0.1", "0.3 -0.2 0.5 -0.6")])], [UPRIGHT, TILTED, THREE]
)
MASK = " ".join(["-1431655766"] * 8)
LBP = cascade(
    [stage([tree(f"0 -1 0 {MASK}", "-0.4 0.6"), tree(f"0 -1 1 {MASK}", "0.3 -0.3")])],
    ["<rect>0 0 4 3</rect>", "<rect>2 1 2 2</rect>"],
    "LBP",
)
OLD = b"""<?xml version="1.0"?>
<opencv_storage><old_one type_id="opencv-haar-classifier"><size>12 10</size><stages>
<_><trees>
  <_><_><feature><rects><_>1 1 6 4 -1.</_><_>1 1 3 4 2.</_></rects><tilted>0</tilted></feature>
     <threshold>0.01</threshold><left_val>0.3</left_val><right_node>1</right_node></_>
     <_><feature><rects><_>6 0 4 5 -1</_><_>6 0 2 5 3</_></rects><tilted>1</tilted></feature>
     <threshold>-0.02</threshold><left_val>-0.2</left_val><right_val>0.5</right_val></_></_>
  <_><_><feature><rects><_>0 0 12 10 -1</_><_>4 0 4 10 3</_></rects><tilted>0</tilted></feature>
     <threshold>0</threshold><left_val>-0.4</left_val><right_val>0.6</right_val></_></_>
  </trees><stage_threshold>-0.5</stage_threshold><parent>-1</parent><next>-1</next></_>
</stages></old_one></opencv_storage>"""

BY_HAND = {"stumps": STUMPS, "trees": TREES, "lbp": LBP, "old": OLD}


def picture(seed: int = 0) -> np.ndarray:
    """Noise in blobs of several sizes, so that every branch of a tree is taken somewhere."""
    generator = np.random.default_rng(seed)
    coarse = cv2.resize(generator.integers(0, 256, (9, 9), np.uint8), (64, 64))
    return cv2.addWeighted(coarse, 0.6, generator.integers(0, 256, (64, 64), np.uint8), 0.4, 0)


def windows_of(classifier: cv2.CascadeClassifier, image: np.ndarray) -> list[tuple]:
    boxes, _, weights = classifier.detectMultiScale3(image, 1.2, minNeighbors=0, outputRejectLevels=True)
    return sorted((*map(int, box), float(w)) for box, w in zip(boxes, np.ravel(weights), strict=True))


def save(data: bytes, folder: Path, name: str = "cascade.xml") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


@pytest.mark.parametrize(
    ("name", "info"),
    [
        ("stumps", CascadeInfo("haar", (12, 10), 2, 3, 3, -1.0)),
        ("trees", CascadeInfo("haar", (12, 10), 1, 1, 3, -0.5)),
        ("lbp", CascadeInfo("lbp", (12, 10), 1, 2, 2, -0.5)),
        ("old", CascadeInfo("haar", (12, 10), 1, 2, 3, -0.5)),
    ],
)
def test_cascades_by_hand_detect_as_opencv_reads_the_file_itself(name, info, tmp_path):
    path = save(BY_HAND[name], tmp_path)
    assert read_cascade_info(path) == info
    expected = windows_of(cv2.CascadeClassifier(str(path)), picture())
    assert 20 < len(expected) < 20000
    assert windows_of(load_cascade(path), picture()) == expected


def real_cascades() -> list[Path]:
    return sorted(REFERENCE.glob("*.xml")) + sorted(Path(cv2.data.haarcascades).glob("*.xml"))


def test_real_cascades_detect_as_opencv_reads_the_file_itself():
    """Cascades of opencv_traincascade, and those in the OpenCV 4 wheel: trees, tilted, old format."""
    if not real_cascades():
        pytest.skip("needs real data: reference cascades")
    for path in real_cascades():
        info, own, theirs = read_cascade_info(path), load_cascade(path), cv2.CascadeClassifier(str(path))
        assert info.window == theirs.getOriginalWindowSize()
        scale = max(info.window) / 10
        image = cv2.resize(picture(3), None, fx=scale, fy=scale)
        assert windows_of(own, image) == windows_of(theirs, image)


def test_a_compressed_cascade_loads(tmp_path):
    import gzip

    assert not load_cascade(save(gzip.compress(STUMPS), tmp_path, "cascade.xml.gz")).empty()


def changed(data: bytes, old: str, new: str) -> bytes:
    text = data.decode()
    assert old in text
    return text.replace(old, new, 1).encode()


NODE = "stage 0: weak classifier 0: "
WRONG = [
    (b"", "not an XML file: no element found"),
    (b"<a", "not an XML file"),
    (b"\x00\x01", "not an XML file"),
    (b"<html/>", "not a cascade: the file does not begin with <opencv_storage>"),
    (b"<opencv_storage></opencv_storage>", "not a cascade"),
    (b'<?xml version="1.0" encoding="x-none"?><a/>', "not an XML file|unknown text encoding"),
    (b'<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "holds a document type or entities"),
    (changed(STUMPS, "BOOST", "TREE"), "not a cascade: <stageType> is not BOOST"),
    (changed(STUMPS, "HAAR", "HOG"), "features of the type 'HOG' cannot be run; HAAR and LBP can"),
    (
        STUMPS.replace(b"featureParams", b"featuhreParams"),
        "<featureParams> is missing, there is <featuhreParams>",
    ),
    (changed(STUMPS, "<maxCatCount>0", "<maxCatCount>256"), "<maxCatCount> is 256, HAAR needs 0"),
    (changed(STUMPS, "<width>12", "<width>0"), "the window is 0x10"),
    (changed(STUMPS, "<width>12", "<width>100000"), "the window is 100000x10"),
    (changed(STUMPS, "<width>12", "<width>12.5"), "<width> holds '12.5', which is not a 32-bit integer"),
    (changed(STUMPS, "<width>12", "<width>12 12"), "<width> must hold one integer, holds 2"),
    (changed(STUMPS, "<width>12</width>", ""), "<width> is missing"),
    (cascade([], [UPRIGHT]), "<stages> is empty"),
    (cascade([stage([])], [UPRIGHT]), "stage 0: <weakClassifiers> is empty"),
    (cascade([stage([tree("0 -1 0 0", "1 2")])], []), "<features> is empty"),
    (changed(STUMPS, "<stageThreshold>-0.5", "<stageThreshold>nan"), "stage 0: .* holds 'nan'"),
    (
        changed(STUMPS, "<stageThreshold>-0.5", "<stageThreshold>"),
        "stage 0: .* must hold one number, holds 0",
    ),
    (
        changed(STUMPS, "-.4 0.6", "-.4 .Inf"),
        NODE + "<leafValues> holds '.Inf', which is not a finite number",
    ),
    (changed(STUMPS, "-.4 0.6", "-.4 1e99"), NODE + "<leafValues> holds '1e99'"),
    (changed(STUMPS, "-.4 0.6", "-.4"), NODE + "1 nodes need 2 leaf values, there are 1"),
    (changed(STUMPS, "0 -1 0 1e-2", "0 -1 3 1e-2"), NODE + "feature 3 does not exist, there are 3"),
    (changed(STUMPS, "0 -1 0 1e-2", "0 -1 -1 1e-2"), NODE + "feature -1 does not exist"),
    (changed(STUMPS, "0 -1 0 1e-2", "-1 0 0 1e-2"), NODE + "a single node must lead to leaves '0 -1'"),
    (changed(STUMPS, "0 -1 0 1e-2", "0 -1 0"), NODE + "<internalNodes> must hold 4 numbers a node, holds 3"),
    (changed(STUMPS, "0 -1 0 1e-2", "0 -1 9999999999 0"), NODE + ".* is not a 32-bit integer"),
    (changed(TREES, "2 1 0 0.01", "3 1 0 0.01"), NODE + "node 0 leads to node 3, allowed are 1 to 2"),
    (changed(TREES, "0 -1 1 -0.02", "1 -1 1 -0.02"), NODE + "node 1 leads to node 1, allowed are 2 to 2"),
    (changed(TREES, "0 -1 1 -0.02", "0 -4 1 -0.02"), NODE + "node 1 leads to leaf 4, the last is 3"),
    (changed(LBP, MASK, "1 2 3"), NODE + "<internalNodes> must hold 11 numbers a node, holds 6"),
    (
        changed(LBP, "0 0 4 3", "0 0 5 3"),
        "feature 0: covers x 0 to 15, y 0 to 9, not a part of the 12x10 window",
    ),
    (changed(LBP, "0 0 4 3", "0 0 4"), "feature 0: <rect> must hold 4 integers, holds 3"),
    (changed(STUMPS, "1 1 6 4 -1.", "7 1 6 4 -1."), "feature 0: covers x 7 to 13"),
    (changed(STUMPS, "1 1 6 4 -1.", "1 1 0 4 -1."), "feature 0: covers"),
    (changed(STUMPS, "1 1 6 4 -1.", "1 1 6 4"), "feature 0: a rectangle is x y w h weight"),
    (changed(STUMPS, "6 0 4 5 -1", "6 0 4 7 -1"), "feature 1: covers x -1 to 10, y 0 to 11"),
    (changed(STUMPS, "<tilted>1", "<tilted>2"), "feature 1: <tilted> must be 0 or 1, is 2"),
    (cascade([stage([tree("0 -1 0 0", "1 2")])], [haar(["0 0 2 2 1"] * 4)]), "feature 0: 4 rectangles"),
    (
        changed(OLD, "<parent>-1", "<parent>3"),
        r"stage 0: a tree of stages \(parent 3, next -1\) cannot be run",
    ),
    (changed(OLD, "<size>12 10", "<size>12"), "<size> must hold width and height"),
    (changed(OLD, "<left_val>0.3</left_val>", ""), "stage 0: tree 0: <left_val> is missing"),
    (
        changed(OLD, "<right_node>1", "<right_node>0"),
        "stage 0: tree 0: <right_node> is 0, but no node leads to the root",
    ),
    (changed(OLD, "<right_node>1", "<right_node>2"), NODE + "node 0 leads to node 2"),
]


@pytest.mark.parametrize(("data", "match"), WRONG)
def test_what_would_harm_is_refused_with_its_place(data, match, tmp_path):
    with pytest.raises(ModelError, match=f"^{re.escape(str(tmp_path))}/cascade.xml: ({match})"):
        load_cascade(save(data, tmp_path))


def test_missing_and_huge_files_are_refused(tmp_path, monkeypatch):
    with pytest.raises(ModelError, match=r"none\.xml: no such file"):
        load_cascade(tmp_path / "none.xml")
    monkeypatch.setattr("laserimg.cascade.xml.MAX_BYTES", 100)
    with pytest.raises(ModelError, match="holds more than"):
        load_cascade(save(STUMPS, tmp_path))


def test_an_opencv_without_cascades_is_named_with_the_pip_line(tmp_path, monkeypatch):
    monkeypatch.delattr(cv2, "CascadeClassifier")
    with pytest.raises(
        ModelError, match=r"has no CascadeClassifier: pip install .*opencv-contrib-python-headless"
    ):
        load_cascade(save(STUMPS, tmp_path))


@given(st.binary() | st.text().map(str.encode))
def test_any_bytes_are_a_cascade_or_a_model_error(data):
    with pytest.raises(ModelError):
        check_cascade(data)


MUTATIONS = 1500
NASTY = "0 1 -1 2 3 11 12 -2147483648 2147483647 99999999999 1e38 -1e38 1e39 nan inf x 0.5 <_/> <a>"


def mutated(data: bytes, generator: random.Random) -> bytes:
    """The file with numbers exchanged, elements lost or doubled, bytes flipped, or cut off."""
    text = data.decode()
    for _ in range(generator.randint(1, 3)):
        numbers = list(re.finditer(r"(?<=[ >])[-.\de]+(?=[ <])", text))
        elements = list(re.finditer(r"<(\w+)>[^<]*</\1>", text))
        if not numbers or not elements:
            break
        place = generator.choice(generator.choice([numbers, elements, numbers]))
        kind = generator.randint(0, 9)
        if kind < 6:
            text = text[: place.start()] + generator.choice(NASTY.split()) + text[place.end() :]
        elif kind < 8:
            text = text[: place.start()] + place[0] * generator.choice([0, 2]) + text[place.end() :]
        elif kind == 8:
            at = generator.randrange(len(text))
            text = text[:at] + chr(generator.randrange(1, 127)) + text[at + 1 :]
        else:
            text = text[: generator.randrange(len(text))]
    return text.encode()


def survive_mutations() -> None:
    """Load and run every mutated file; what is not refused must run to its end."""
    generator, image, counts = random.Random(0), picture(), {"loaded": 0, "refused": 0}
    with tempfile.TemporaryDirectory() as folder:
        for data in BY_HAND.values():
            for _ in range(MUTATIONS // len(BY_HAND)):
                path = save(mutated(data, generator), Path(folder))
                try:
                    classifier = load_cascade(path)
                except ModelError:
                    counts["refused"] += 1
                    continue
                classifier.detectMultiScale(image, 1.5, 0)
                counts["loaded"] += 1
    sys.stdout.write(f"{counts['loaded']} {counts['refused']}")


def test_mutated_cascades_never_harm_the_process():
    """In a process of its own: a crash would take the test run with it."""
    done = subprocess.run(
        [sys.executable, __file__],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    loaded, refused = map(int, done.stdout.split())
    assert loaded > MUTATIONS / 20
    assert refused > MUTATIONS / 2


def test_a_window_without_contrast_is_no_hit_of_a_single_stage():
    """OpenCV returns -1 both for such a window and for one that fails the second stage."""
    xml = check_cascade(TREES)[1]
    storage = cv2.FileStorage(xml, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    classifier = cv2.CascadeClassifier()
    assert classifier.read(storage.getFirstTopLevelNode())
    assert windows_of(classifier, np.full((40, 40), 90, np.uint8)) == []


if __name__ == "__main__":
    survive_mutations()
