"""Detectors on disk: what fits its card is loaded, all else is a ModelError."""

import io
import os
import random
import subprocess
import sys
import tempfile
import zipfile
from hashlib import sha256
from pathlib import Path

import cv2
import numpy as np
import pytest

from laserimg.detectors.cascade import CascadeModel
from laserimg.detectors.hog import HogModel, load_hog, save_hog
from laserimg.detectors.shipped import detector_files, load_model, shipped_folder
from laserimg.errors import ModelError
from laserimg.formats.card import Card, write_card
from window_models import HOG, blob_xml, disc_hog

SIZES = {"winSize", "blockSize", "blockStride", "cellSize"}


def saved(folder, data, name, **card):
    """A detector's file, with a card beside it if there is anything to put in one."""
    path = folder / name
    path.write_bytes(data)
    if card:
        known = {"label": "bin", "image": "range", "sha256": sha256(data).hexdigest()}
        write_card(path.with_suffix(".toml"), Card(**(known | card)))
    return path


def hog_file(folder, name="hog.npz", **changes):
    """A HOG file with some of its arrays changed; those set to None are left out."""
    with np.load(io.BytesIO(disc_hog())) as file:
        arrays = {key: file[key] for key in file} | changes
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=True, **{key: value for key, value in arrays.items() if value is not None})
    return saved(folder, buffer.getvalue(), name)


def test_a_cascade_loads_with_its_card(tmp_path):
    card = {"kind": "haar", "window": (24, 24), "object_size_m": (0.3, 0.4), "margin": 0.5}
    model = load_model(saved(tmp_path, blob_xml(), "blob.xml", **card))
    assert isinstance(model, CascadeModel)
    assert (model.name, model.card.label, model.card.object_size_m) == ("blob", "bin", (0.3, 0.4))
    image = np.full((24, 24), 40, np.uint8)
    image[6:18, 6:18] = 200
    assert model.hits(image).corners.tolist() == [[0, 0]]


def test_a_cascade_without_card_is_told_image_and_class(tmp_path):
    path = saved(tmp_path, blob_xml(), "blob.xml")
    card = load_model(path, "normals.b", "bin").card
    assert (card.image, card.label, card.kind, card.window) == ("normals.b", "bin", "haar", (24, 24))
    for image, label in ((None, "bin"), ("range", None), (None, None)):
        with pytest.raises(ModelError, match=r"blob\.xml: no card beside it.*--image and --label"):
            load_model(path, image, label)
    with pytest.raises(ModelError, match="no kind of image 'normal'; known: range, reflectance"):
        load_model(path, "normal", "bin")


def test_a_hog_file_reads_back_as_written(tmp_path):
    rng = np.random.default_rng(0)
    arguments = HOG | {"signedGradient": True, "winSize": (32, 24), "L2HysThreshold": 0.3, "nbins": 7}
    weights = rng.normal(size=cv2.HOGDescriptor(*arguments.values()).getDescriptorSize())
    path = saved(tmp_path, save_hog(arguments, weights, -0.25), "hog.npz", kind="hog", window=(32, 24))
    model = load_model(path)
    assert isinstance(model, HogModel)
    for name, value in arguments.items():
        read = getattr(model.descriptor, name if name != "histogramNormType" else "histogramNormType")
        assert tuple(read) == value if name in SIZES else read == pytest.approx(value)
    # Flat windows have no gradients: what is left of the sum is the bias.
    assert len(model.hits(np.full((24, 32), 9, np.uint8)).corners) == 0
    path = saved(tmp_path, save_hog(arguments, weights, 0.25), "hog.npz", kind="hog", window=(32, 24))
    assert load_model(path).hits(np.full((24, 32), 9, np.uint8)).margins == pytest.approx([0.25])


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"weights": None}, "array 'weights' is missing"),
        ({"nbins": None}, "array 'nbins' is missing"),
        ({"weights": np.zeros(5)}, "5 weights for 1764 values of the window"),
        ({"weights": np.full(1764, np.nan)}, "the weights are not finite"),
        ({"weights": np.full(1764, 1e300)}, "the weights are not finite"),
        ({"bias": np.inf}, "bias must be one number of 32 bits"),
        ({"bias": np.zeros(2)}, "bias must be one number"),
        ({"nbins": 0}, "nbins must be from 1 to 180, is 0"),
        ({"nbins": 2**40}, "nbins must be one number of 32 bits"),
        ({"winSize": np.array([32, 32, 3])}, "winSize must be two numbers"),
        ({"winSize": np.array([32, 1 << 20])}, r"winSize must be from 1 to 1024, is \(32, 1048576\)"),
        ({"cellSize": np.array([0, 4])}, r"cellSize must be from 1 to 1024, is \(0, 4\)"),
        ({"cellSize": np.array([-4, 4])}, "cellSize must be from 1"),
        ({"blockStride": np.array([5, 4])}, "do not fit"),
        ({"cellSize": np.array([3, 3])}, "do not fit"),
        ({"blockSize": np.array([64, 64])}, "do not fit"),
        ({"histogramNormType": 3}, "histogramNormType is 3, OpenCV knows 0"),
        ({"weights": np.array([{}], object)}, "not an NPZ file"),
        ({"nbins": np.array("nine")}, "not an NPZ file"),
        ({"nbins": np.float64(np.nan)}, "nbins must be one number"),
    ],
)
def test_a_wrong_hog_file_is_refused_with_its_reason(changes, match, tmp_path):
    with pytest.raises(ModelError, match=rf"hog\.npz: .*{match}"):
        load_hog(hog_file(tmp_path, **changes))


def test_a_hog_file_that_claims_much_takes_no_memory(tmp_path):
    """A header of 8 TB, and zeros that unpack to 4 GB."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**12,)})
    for name, data in (("huge.npz", header.getvalue() + b"\0" * 64), ("bomb.npz", None)):
        with zipfile.ZipFile(tmp_path / name, "w", zipfile.ZIP_DEFLATED) as archive:
            if data is not None:
                archive.writestr("weights.npy", data)
            else:
                with archive.open("weights.npy", "w", force_zip64=True) as member:
                    for _ in range(40):
                        member.write(bytes(1 << 20))
    with pytest.raises(ModelError, match=r"huge\.npz: not an NPZ file: an array of \(1000000000000,\)"):
        load_hog(tmp_path / "huge.npz")
    with pytest.raises(ModelError, match=r"bomb\.npz: unpacks to more than 16 MB"):
        load_hog(tmp_path / "bomb.npz")


def test_a_hog_of_blocks_that_would_fill_the_memory_is_refused(tmp_path):
    """One block of a thousand cells, and every pixel of a wide image would hold one."""
    arguments = HOG | {"winSize": (64, 64), "blockSize": (64, 64), "blockStride": (1, 1), "cellSize": (2, 2)}
    descriptor = cv2.HOGDescriptor(*arguments.values())
    data = save_hog(arguments, np.zeros(descriptor.getDescriptorSize()), 0.0)
    with pytest.raises(ModelError, match="take too much memory"):
        load_hog(saved(tmp_path, data, "hog.npz"))


@pytest.mark.parametrize(
    ("data", "name", "card", "match"),
    [
        (
            blob_xml(),
            "a.xml",
            {"kind": "haar", "window": (20, 24)},
            r"a\.toml: says haar with a window of 20x24, .* 24x24",
        ),
        (blob_xml(), "a.xml", {"kind": "lbp", "window": (24, 24)}, r"a\.toml: says lbp .* is haar"),
        (blob_xml(), "a.xml", {"kind": "hog", "window": (24, 24)}, r"a\.toml: kind is 'hog', which a\.xml"),
        (
            blob_xml(),
            "a.xml",
            {"kind": "haar", "window": (24, 24), "sha256": "0" * 64},
            r"a\.xml: is not the file",
        ),
        (b"", "a.xml", {"kind": "haar", "window": (24, 24)}, r"a\.xml: not an XML file"),
        (
            None,
            "a.npz",
            {"kind": "hog", "window": (24, 32)},
            r"a\.toml: says hog with a window of 24x32, .* 32x32",
        ),
        (None, "a.npz", {"kind": "haar", "window": (32, 32)}, r"a\.toml: kind is 'haar', which a\.npz"),
        (None, "a.npz", {}, r"a\.npz: no card beside it \(a\.toml\)"),
        (b"PK\3\4", "a.npz", {"kind": "hog", "window": (32, 32)}, r"a\.npz: not an NPZ file"),
    ],
)
def test_a_card_of_another_detector_is_an_error(data, name, card, match, tmp_path):
    with pytest.raises(ModelError, match=match):
        load_model(saved(tmp_path, disc_hog() if data is None else data, name, **card))


def test_a_missing_detector_is_an_error(tmp_path):
    for name in ("none.xml", "none.npz", "none"):
        with pytest.raises(ModelError, match="none"):
            load_model(tmp_path / name, "range", "bin")
        with pytest.raises(ModelError, match=r"none.*: no such file or folder"):
            detector_files(tmp_path / name)


def test_a_folder_gives_its_cascades_and_the_hog_files_that_have_a_card(tmp_path):
    cascade = saved(tmp_path, blob_xml(), "b.xml")
    hog = saved(tmp_path, disc_hog(), "a.npz", kind="hog", window=(32, 32))
    saved(tmp_path, disc_hog(), "scan.npz")
    saved(tmp_path, b"", "notes.txt")
    assert detector_files(tmp_path) == [hog, cascade]
    assert detector_files(cascade) == [cascade]


def test_the_shipped_detectors_lie_in_the_package_or_beside_it(tmp_path, monkeypatch):
    import laserimg

    for inside in (False, True):
        package = tmp_path / str(inside) / "laserimg"
        beside = package.parent / "cascades"
        beside.mkdir(parents=True)
        package.mkdir()
        if inside:
            (package / "cascades").mkdir()
        monkeypatch.setattr(laserimg, "__file__", str(package / "__init__.py"))
        assert shipped_folder() == (package / "cascades" if inside else beside)


def mutated(data, rng):
    """A file with a few bytes changed, lost or doubled, or cut off."""
    data, kind = bytearray(data), rng.randrange(4)
    for _ in range(rng.randrange(1, 4)):
        place = rng.randrange(len(data))
        if kind == 0:
            data[place] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del data[place : place + rng.randrange(1, 50)]
        elif kind == 2:
            data[place:place] = data[rng.randrange(len(data)) :][: rng.randrange(1, 50)]
    return bytes(data[: rng.randrange(len(data))] if kind == 3 else data)


def with_other_numbers(rng):
    """A HOG file whose checksums are right, and one or two of whose numbers are not those of before."""
    with np.load(io.BytesIO(disc_hog())) as file:
        arrays = {key: np.atleast_1d(file[key]).astype(float) for key in file}
    for name in rng.sample(sorted(arrays), rng.randrange(1, 3)):
        odd = [0, 1, -1, 2, 3, 7, 8, 16, 64, 180, 1024, 2**31, 2**62, 0.5, 1e30, np.nan, np.inf]
        if rng.random() < 0.1:
            arrays[name] = np.resize(arrays[name], rng.choice([0, 1, 3]))
        elif rng.random() < 0.5:
            arrays[name][:] = rng.choice(odd)
        else:
            arrays[name][rng.randrange(len(arrays[name]))] = rng.choice(odd)
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def survive_mutations(rounds=600):
    """Load mutated files and run what loads; anything but a ModelError ends the process with an error."""
    rng, image, loaded = random.Random(0), np.random.default_rng(0).integers(0, 256, (90, 99), np.uint8), 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(rounds):
            path = Path(folder) / ("a.npz" if number % 3 else "a.xml")
            good = disc_hog() if number % 3 else blob_xml()
            path.write_bytes(with_other_numbers(rng) if number % 3 == 2 else mutated(good, rng))
            try:
                if number % 3 == 0:
                    load_model(path, "range", "bin").hits(image)
                else:
                    descriptor = load_hog(path)
                    card = Card("bin", "hog", "range", tuple(descriptor.winSize), "0" * 64)
                    HogModel("a", card, descriptor).hits(image)
            except ModelError:
                continue
            loaded += 1
    assert rounds / 20 < loaded < rounds / 2, loaded


def test_mutated_detectors_never_harm_the_process():
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    done = subprocess.run(
        [sys.executable, __file__], env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr[-2000:]


if __name__ == "__main__":
    survive_mutations()
