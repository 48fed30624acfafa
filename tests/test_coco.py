"""COCO files: written and read back, matched to scans, refused with the annotation named."""

import csv
import io
import json
import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laserimg.errors import LabelError
from laserimg.formats.coco import Annotation, Category, CheckRecord, CocoFile, CocoImage, Position, Size
from laserimg.formats.coco_file import coco_text, read_coco, write_coco
from laserimg.formats.detections_csv import detections_csv, write_detections_csv
from laserimg.scan import Scan

WIDTH, HEIGHT = 40, 20


ROOM = (CocoImage(1, "room.pcd", WIDTH, HEIGHT),)


def coco(*annotations: Annotation, images=ROOM, **fields) -> CocoFile:
    return CocoFile(tuple(images), (Category(1, "bin"), Category(2, "car")), annotations, **fields)


def scan(source: str, index: int = 0, wraps: bool = False, width: int = WIDTH) -> Scan:
    angles = np.linspace(1, -1, width), np.linspace(0.3, -0.3, HEIGHT)
    return Scan.from_range_image(np.ones((HEIGHT, width)), *angles, source=source, index=index, wraps=wraps)


numbers = st.floats(-1e6, 1e6).map(lambda value: round(value, 6) + 0.0)
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
boxes = st.tuples(
    st.integers(0, WIDTH - 1), st.integers(0, HEIGHT // 2), st.integers(1, WIDTH), st.integers(1, HEIGHT // 2)
).map(lambda box: tuple(value * 1.0 for value in box))
optional_numbers = st.none() | numbers
checks = st.builds(
    CheckRecord, texts, optional_numbers, st.tuples(optional_numbers, optional_numbers), st.booleans()
)
sizes = st.builds(Size, *[numbers] * 5)
positions = st.builds(Position, *[numbers] * 6, optional_numbers)
truths = st.builds(
    Annotation,
    id=st.integers(0, 1000),
    image_id=st.just(1),
    category_id=st.sampled_from([1, 2]),
    bbox=boxes,
    area=st.none() | numbers,
    iscrowd=st.sampled_from([0, 1]),
    score=optional_numbers,
)
judged = st.builds(
    replace,
    truths,
    region_bbox=st.none() | boxes,
    source=texts,
    accepted=st.booleans(),
    reason=texts,
    checks=st.lists(checks, max_size=3, unique_by=lambda check: check.name).map(tuple),
    size=st.none() | sizes,
    position=st.none() | positions,
)
files = st.builds(
    lambda annotations, info: coco(*annotations, info=info),
    st.lists(truths | judged, max_size=4, unique_by=lambda annotation: annotation.id),
    st.dictionaries(texts, texts | numbers | st.lists(numbers | st.none())),
)


@given(files)
def test_a_file_reads_back_as_written(tmp_path_factory, written):
    path = tmp_path_factory.mktemp("coco") / "detections.json"
    write_coco(path, written)
    assert read_coco(path) == replace(written, source=str(path))


@given(files)
def test_the_csv_holds_what_the_json_holds(written):
    document = json.loads(coco_text(written))
    rows = list(csv.DictReader(io.StringIO(detections_csv(written), newline="")))
    labels = {entry["id"]: entry["name"] for entry in document["categories"]}
    assert len(rows) == len(document["annotations"])
    for row, entry in zip(rows, document["annotations"], strict=True):
        flat = flattened(entry) | {"file_name": "room.pcd", "scan": 0, "label": labels[entry["category_id"]]}
        del flat["image_id"], flat["category_id"]
        if "accepted" not in entry:
            flat |= {"source": "", "reason": ""}
        assert {name: cell for name, cell in row.items() if cell} == {
            name: cell_of(value) for name, value in flat.items() if value not in (None, "")
        }


def flattened(entry: dict) -> dict:
    """An annotation of the JSON file as the CSV should have it, by another way."""
    flat = {}
    for key, value in entry.items():
        if key in ("bbox", "region_bbox"):
            flat |= {f"{key}.{side}": value["xywh".index(side)] for side in "xywh"}
        elif key in ("size", "position"):
            flat |= {f"{key}.{name}": number for name, number in value.items()}
        elif key == "checks":
            for check in value:
                low, high = check.pop("limit")
                for name, cell in {**check, "low": low, "high": high}.items():
                    if name != "name":
                        flat[f"checks.{check['name']}.{name}"] = cell
        else:
            flat[key] = value
    return flat


def cell_of(value) -> str:
    return json.dumps(value) if isinstance(value, bool) else str(value)


FOUND = Annotation(
    3,
    1,
    2,
    (1.0, 2.0, 3.5, 4.123456789),
    region_bbox=(1.0, 2.0, 3.0, 4.0),
    area=11.0,
    score=0.25,
    source="given",
    accepted=False,
    reason="height 0.81 m > 0.60 m",
    checks=(
        CheckRecord("region_inside", 0.95, (0.9, None), True),
        CheckRecord("height", 0.81, (0.2, 0.6), False),
        CheckRecord("height_above_floor", None, (None, 0.2), True),
    ),
    size=Size(0.1, 0.2, 0.81, 0.3, 0.15),
    position=Position(1.0, 2.0, -0.0, 2.25, 63.4, -1.5),
)


def test_detections_are_written_with_the_keys_of_the_contract():
    text = coco_text(coco(FOUND, info={"version": "0.1.0"}))
    assert "-0.0" not in text
    document = json.loads(text)
    assert list(document) == ["info", "images", "categories", "annotations"]
    assert document["images"] == [
        {"id": 1, "file_name": "room.pcd", "width": WIDTH, "height": HEIGHT, "scan": 0}
    ]
    assert document["categories"][1] == {"id": 2, "name": "car"}
    assert document["annotations"] == [
        {
            "id": 3,
            "image_id": 1,
            "category_id": 2,
            "bbox": [1.0, 2.0, 3.5, 4.123457],
            "region_bbox": [1.0, 2.0, 3.0, 4.0],
            "area": 11.0,
            "iscrowd": 0,
            "score": 0.25,
            "source": "given",
            "accepted": False,
            "reason": "height 0.81 m > 0.60 m",
            "checks": [
                {"name": "region_inside", "value": 0.95, "limit": [0.9, None], "passed": True},
                {"name": "height", "value": 0.81, "limit": [0.2, 0.6], "passed": False},
                {"name": "height_above_floor", "value": None, "limit": [None, 0.2], "passed": True},
            ],
            "size": {"width": 0.1, "depth": 0.2, "height": 0.81, "length": 0.3, "breadth": 0.15},
            "position": {
                "x": 1.0,
                "y": 2.0,
                "z": 0.0,
                "range": 2.25,
                "azimuth_deg": 63.4,
                "elevation_deg": -1.5,
            },
        }
    ]


def test_a_candidate_without_return_has_neither_size_nor_position():
    accepted = replace(FOUND, accepted=True, reason="", checks=(), size=None, position=None, region_bbox=None)
    entry = json.loads(coco_text(coco(accepted)))["annotations"][0]
    assert entry["reason"] == ""
    assert entry["checks"] == []
    assert not entry.keys() & {"size", "position", "region_bbox"}


def test_truth_is_written_without_the_keys_of_detections():
    entry = json.loads(coco_text(coco(Annotation(1, 1, 1, (0.0, 0.0, 2.0, 3.0)))))["annotations"][0]
    assert entry == {
        "id": 1,
        "image_id": 1,
        "category_id": 1,
        "bbox": [0.0, 0.0, 2.0, 3.0],
        "area": 6.0,
        "iscrowd": 0,
    }


def test_every_field_of_a_size_is_a_quantity_of_the_rules():
    from laserimg.rules.model import QUANTITIES

    assert {field.name for field in fields(Size)} <= QUANTITIES.keys()


def test_nothing_is_written_when_a_number_is_not_finite(tmp_path):
    with pytest.raises(LabelError, match="a number is not finite"):
        write_coco(tmp_path / "a.json", coco(replace(FOUND, score=math.nan)))
    assert list(tmp_path.iterdir()) == []


def test_a_file_name_that_is_no_utf8_is_written_out(tmp_path):
    found = coco(FOUND, images=(CocoImage(1, "caf\udce9.pcd", WIDTH, HEIGHT),))
    write_coco(tmp_path / "a.json", found)
    assert read_coco(tmp_path / "a.json").images[0].file_name == r"caf\udce9.pcd"
    write_detections_csv(tmp_path / "a.csv", found)
    assert r"caf\udce9.pcd,0,car" in (tmp_path / "a.csv").read_text()


def test_the_csv_of_no_detections_has_its_header(tmp_path):
    write_detections_csv(tmp_path / "detections.csv", coco())
    assert (tmp_path / "detections.csv").read_text().startswith("file_name,scan,label,id,accepted,reason,")


def entry(**changes) -> dict:
    return {"id": 7, "image_id": 1, "category_id": 1, "bbox": [1, 2, 3, 4]} | changes


def document(*annotations, **changes) -> dict:
    image = {"id": 1, "file_name": "a.pcd", "width": 10, "height": 8}
    base = {"images": [image], "categories": [{"id": 1, "name": "bin"}], "annotations": list(annotations)}
    return base | changes


def without(entry: dict, key: str) -> dict:
    return {name: value for name, value in entry.items() if name != key}


IMAGE = document()["images"][0]
WRONG = [
    ("", "not JSON: EOF"),
    ('{"images": [', "not JSON: EOF"),
    ("[" * 10**5, "not JSON: recursion limit"),
    ("[]", 'not a COCO file: it must hold "images", "categories" and "annotations"'),
    ("{}", "key 'images' is missing"),
    (document(images={}), "images should be a valid array"),
    (document(images=[3]), r"images\[0\] should be an object"),
    (document(images=[without(IMAGE, "width")]), "image 1: key 'width' is missing"),
    (document(images=[IMAGE | {"height": 0}]), "image 1: height should be greater than 0"),
    (document(images=[IMAGE | {"height": 1e99}]), "image 1: height should be a valid integer"),
    (document(images=[IMAGE, IMAGE]), "image 1 is there twice"),
    (document(categories=[{"id": 1, "name": ""}]), "category 1: name should"),
    (document(categories=[{"id": 1, "name": "a"}] * 2), "category 1 is there twice"),
    (document(entry(), entry()), "annotation 7 is there twice"),
    (document(without(entry(), "id")), "annotation number 1 of the list: key 'id' is missing"),
    (document(entry(id="7")), "annotation number 1 of the list: id should be a valid integer"),
    (document(entry(id=-1)), "annotation -1: id should be greater than or equal to 0"),
    (document(without(entry(), "bbox")), "annotation 7: key 'bbox' is missing"),
    (document(entry(bbox=[1, 2, 3])), "annotation 7: bbox holds only 3 values"),
    (document(entry(bbox=[1, 2, 3, 4, 5])), "annotation 7: bbox should have at most 4 items"),
    (document(entry(bbox=[1, 2, "3", 4])), r"annotation 7: bbox\[2\] should be a valid number"),
    (document(entry(bbox=[1, 2, math.nan, 4])), r"annotation 7: bbox\[2\] should be a finite number"),
    (document(entry(bbox=[1, 2, True, 4])), r"annotation 7: bbox\[2\] should be a valid number"),
    (document(entry(bbox=[1, 2, 0, 4])), r"annotation 7: box \[1, 2, 0, 4\] has no area"),
    (document(entry(bbox=[1, 2, 3, -4])), "annotation 7: box .* has no area"),
    (
        document(entry(bbox=[1, 2, 3, 7])),
        r"annotation 7: box \[1, 2, 3, 7\] is not inside the image of 10 columns",
    ),
    (document(entry(bbox=[-1, 2, 3, 4])), "annotation 7: box .* is not inside"),
    (document(entry(bbox=[10, 2, 3, 4])), "annotation 7: box .* is not inside"),
    (document(entry(bbox=[1, -1, 3, 4])), "annotation 7: box .* is not inside"),
    (document(entry(bbox=[1, 2, 11, 4])), "annotation 7: box .* is not inside"),
    (document(entry(region_bbox=[1, 2, 11, 4])), "annotation 7: box .* is not inside"),
    (document(entry(image_id=2)), "annotation 7: image 2 does not exist"),
    (document(entry(category_id=2)), "annotation 7: category 2 does not exist"),
    (document(entry(score="0.5")), "annotation 7: score should be a valid number"),
    (document(entry(iscrowd=2)), "annotation 7: iscrowd should be less than or equal to 1"),
    (document(entry(checks=[{"name": "a"}])), r"annotation 7: checks\[0\]: key 'value' is missing"),
    (
        document(entry(checks=[{"name": "a", "value": 1, "limit": [0, 1], "passed": True}] * 2)),
        "annotation 7: two of its checks have the same name",
    ),
]


@pytest.mark.parametrize(("content", "match"), WRONG)
def test_bad_files_are_named_with_the_annotation(tmp_path, content, match):
    path = tmp_path / "a.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    with pytest.raises(LabelError, match=rf"^{tmp_path}/a\.json: {match}"):
        read_coco(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(LabelError, match=r"none\.json: no such file"):
        read_coco(tmp_path / "none.json")


@given(st.binary() | st.text().map(str.encode))
def test_any_bytes_are_a_label_error(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("any") / "a.json"
    path.write_bytes(data)
    with pytest.raises(LabelError):
        read_coco(path)


def test_keys_of_other_tools_are_passed_over(tmp_path):
    path = tmp_path / "a.json"
    extra = entry(segmentation=[[1, 2]], attributes={"occluded": False}, area=5.5)
    path.write_text(json.dumps(document(extra, licenses=[], info={"year": 2026})))
    read = read_coco(path)
    kept = Annotation(7, 1, 1, (1.0, 2.0, 3.0, 4.0), area=5.5, segmentation=[[1, 2]])
    assert read.annotations == (kept,)
    assert read.info == {"year": 2026}


def test_boxes_may_overstep_by_parts_of_a_pixel_and_cross_the_seam():
    boxes = [(-0.4, -0.4, 5.0, 5.0), (35.0, 16.0, 20.0, 4.4)]
    labels = coco(*(Annotation(number, 1, 1, box) for number, box in enumerate(boxes, 1)))
    assert [one.bbox for one in labels.annotations] == boxes


def test_a_box_across_the_last_column_needs_a_grid_that_wraps():
    labels = coco(Annotation(1, 1, 1, (35.0, 1.0, 10.0, 4.0)))
    assert labels.annotations_of(scan("room.pcd", wraps=True)) == labels.annotations
    with pytest.raises(LabelError, match=r"annotation 1: box \[35, 1, 10, 4\] leaves the 40 columns"):
        labels.annotations_of(scan("room.pcd"))


def test_the_grid_must_be_that_of_the_image():
    with pytest.raises(
        LabelError, match=r"image 1 .room.pcd. has 40 columns and 20 rows, the scan room.npz has 41"
    ):
        coco().annotations_of(scan("room.npz", width=41))


IMAGES = (
    CocoImage(1, "site/a/room.pcd.bz2", WIDTH, HEIGHT),
    CocoImage(2, "b\\room.pcd", WIDTH, HEIGHT),
    CocoImage(3, "street.pcap", WIDTH, HEIGHT, scan=4),
    CocoImage(4, "street.pcap", WIDTH, HEIGHT, scan=5),
)


@pytest.mark.parametrize(
    ("source", "index", "found"),
    [
        ("/data/a/room.npz", 0, 1),
        ("/data/b/room.ptx.gz", 0, 2),
        ("/data/b/room.ptx.gz", 1, None),
        ("street.pcap", 4, 3),
        ("x/street.pcap.xz", 5, 4),
        ("street.pcap", 0, None),
        ("avenue.pcap", 4, None),
    ],
)
def test_images_are_found_by_stem_scan_and_folder(source, index, found):
    image = coco(images=IMAGES).image_of(source, index)
    assert (image and image.id) == found


def test_images_that_fit_equally_well_are_an_error():
    with pytest.raises(
        LabelError, match=r"c/room.pcd may be any of the images site/a/room.pcd.bz2, b\\room.pcd"
    ):
        coco(images=IMAGES).image_of("c/room.pcd")


def test_a_file_of_one_image_matches_the_only_scan():
    labels = coco(Annotation(1, 1, 1, (1.0, 1.0, 2.0, 2.0)), Annotation(5, 1, 2, (2.0, 1.0, 2.0, 2.0)))
    assert labels.annotations_of(scan("other.ptx", index=3), only=True) == labels.annotations
    assert labels.annotations_of(scan("other.ptx", index=3)) == ()
    assert coco(images=IMAGES).image_of("other.ptx", only=True) is None


@pytest.mark.parametrize(
    ("name", "labels"),
    [
        ("office_room/room_scan1.coco.json", {1: "drum", 2: "office_chair", 3: "wastebasket"}),
        ("leica_ptx/1.coco.json", {1: "car"}),
        ("staircase/scan.coco.json", {1: "stairs"}),
    ],
)
def test_hand_drawn_boxes_of_real_scans(data, name, labels):
    read = read_coco(data(name))
    assert read.labels == labels
    image = read.images[0]
    assert read.image_of(str(Path(name).parent / image.file_name)) == image
    assert json.loads(coco_text(read))["annotations"] == json.loads(data(name).read_text())["annotations"]
