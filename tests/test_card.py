"""Cards of detectors: read with the line of a mistake, bound to their file, written by the command line."""

import sys
from dataclasses import replace
from hashlib import sha256

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from laserimg.cli import main
from laserimg.errors import ModelError
from laserimg.formats.card import IMAGES, PLANES, Card, card_text, read_card, read_card_of, write_card

CASCADE = b"""<opencv_storage><cascade><stageType>BOOST</stageType><featureType>HAAR</featureType>
<height>10</height><width>12</width><featureParams><maxCatCount>0</maxCatCount></featureParams>
<stages><_><stageThreshold>0</stageThreshold><weakClassifiers><_><internalNodes>0 -1 0 0.1</internalNodes>
<leafValues>-1 1</leafValues></_></weakClassifiers></_></stages>
<features><_><rects><_>1 1 6 4 -1.</_><_>1 1 3 4 2.</_></rects><tilted>0</tilted></_></features>
</cascade></opencv_storage>"""
DIGEST = "0123456789abcdef" * 4

lengths = st.floats(0.01, 100)
pixels = st.integers(1, 4096)
words = st.text(st.characters(exclude_categories=["Cs"]))
cards = st.builds(
    Card,
    label=words.filter(bool),
    kind=st.sampled_from(["haar", "lbp", "hog"]),
    image=st.sampled_from([*IMAGES, *PLANES]),
    window=st.tuples(pixels, pixels),
    sha256=st.just(DIGEST),
    object_size_m=st.none() | st.tuples(lengths, lengths),
    margin=st.floats(0, 10),
    stages=st.none() | st.integers(1, 100),
    trained_on=words,
    seed=st.none() | st.integers(-(2**63), 2**63 - 1),
    recipe_sha256=st.none() | st.just(DIGEST),
    licence=words,
    versions=st.dictionaries(words, words, max_size=3),
    scores=st.dictionaries(words, st.floats(allow_nan=False, allow_infinity=False), max_size=3),
)


@given(cards)
@settings(deadline=None)
def test_a_card_reads_back_as_written(tmp_path_factory, card):
    path = tmp_path_factory.mktemp("cards") / "bin.toml"
    write_card(path, card)
    assert read_card(path) == card


def test_the_keys_of_the_file_are_those_of_the_contract():
    card = Card("bin", "haar", "normals_view.r", (20, 24), DIGEST, (0.25, 0.36), 0.1, 12, seed=0)
    assert card_text(card).splitlines() == [
        "format = 1",
        'class = "bin"',
        'kind = "haar"',
        'image = "normals_view.r"',
        "window = [20, 24]",
        f'sha256 = "{DIGEST}"',
        "object_size_m = [0.25, 0.36]",
        "margin = 0.1",
        "stages = 12",
        "seed = 0",
    ]


GOOD = f"""format = 1
# by hand
class = "bin"
kind = "haar"
image = "normals"
window = [20, 20]
sha256 = "{DIGEST}"
"""


@pytest.mark.parametrize(
    ("old", "new", "line", "match"),
    [
        ("format = 1\n", "", 1, "a card must begin with format = 1"),
        ("format = 1", "format = 2", 1, "format should be 1"),
        ("kind =", "knd =", 4, "unknown key 'knd', did you mean 'kind'?"),
        ("class =", "label =", 3, "unknown key 'label'; known are class, kind, image"),
        ('kind = "haar"\n', "", 1, "key 'kind' is missing"),
        ('"haar"', '"har"', 4, "unknown kind 'har', did you mean 'haar'?"),
        ('"normals"', '"normal_view"', 5, "unknown image 'normal_view', did you mean 'normals_view'?"),
        ("[20, 20]", "[20]", 6, "window holds only 1 values"),
        ("[20, 20]", "[20, 0]", 6, r"window\[1\] should be greater than or equal to 1"),
        ("[20, 20]", "[20, true]", 6, r"window\[1\] should be a valid integer"),
        ("[20, 20]", "[20, 20, 20]", 6, "window should have at most 2 items"),
        (DIGEST, "abc", 7, "sha256 should match pattern"),
        (f'"{DIGEST}"\n', f'"{DIGEST}"\nmargin = nan\n', 8, "margin should be a finite number"),
        (f'"{DIGEST}"\n', f'"{DIGEST}"\nstages = "3"\n', 8, "stages should be a valid integer"),
        (
            f'"{DIGEST}"\n',
            f'"{DIGEST}"\nobject_size = [1, 2]\n',
            8,
            "unknown key 'object_size', did you mean 'object_size_m'",
        ),
        (
            f'"{DIGEST}"\n',
            f'"{DIGEST}"\n[scores]\na = 1\nap = "x"\n',
            10,
            "scores.ap should be a valid number",
        ),
        ("[20, 20]", "[20, 20", 7, "Unclosed array"),
    ],
)
def test_mistakes_are_named_with_file_and_line(tmp_path, old, new, line, match):
    path = tmp_path / "bin.toml"
    assert old in GOOD
    path.write_text(GOOD.replace(old, new))
    with pytest.raises(ModelError, match=rf"bin\.toml:{line}: {match}"):
        read_card(path)


def test_a_card_that_would_not_read_is_not_written(tmp_path):
    card = Card("bin", "haar", "normals", (20, 20), DIGEST)
    with pytest.raises(ModelError, match="margin should be greater than or equal to 0"):
        write_card(tmp_path / "bin.toml", replace(card, margin=-1.0))
    assert list(tmp_path.iterdir()) == []


def test_a_card_belongs_to_its_file(tmp_path):
    model = tmp_path / "bin.xml"
    model.write_bytes(b"one")
    assert read_card_of(model) is None
    card = Card("bin", "haar", "normals", (20, 20), sha256(b"one").hexdigest())
    write_card(tmp_path / "bin.toml", card)
    assert read_card_of(model) == card
    model.write_bytes(b"two")
    with pytest.raises(ModelError, match=r"bin\.xml: is not the file that its card bin\.toml describes"):
        read_card_of(model)
    write_card(tmp_path / "bin.toml", replace(card, kind="hog"))
    with pytest.raises(ModelError, match=r"bin\.toml: kind is 'hog', which bin\.xml cannot be"):
        read_card_of(model)


@pytest.fixture
def laserimg_card(tmp_path, monkeypatch, capsys):
    """Run ``laserimg card`` in a folder with one cascade: exit code, output, errors."""
    (tmp_path / "bin.xml").write_bytes(CASCADE)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["laserimg", "card", *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        return stop.value.code or 0, *capsys.readouterr()

    return run


def test_a_first_card_takes_what_the_cascade_says(laserimg_card, tmp_path):
    code, out, _ = laserimg_card(
        "bin.xml",
        "--class",
        "bin",
        "--image",
        "normals_view",
        "--object-size",
        "0.25x0.36",
        "--score",
        "ap50=0.9",
    )
    assert code == 0
    assert out.startswith('bin.toml\n\nformat = 1\nclass = "bin"\n')
    digest = sha256(CASCADE).hexdigest()
    assert read_card_of(tmp_path / "bin.xml") == Card(
        "bin", "haar", "normals_view", (12, 10), digest, (0.25, 0.36), stages=1, scores={"ap50": 0.9}
    )


def test_what_is_not_given_stays(laserimg_card, tmp_path):
    laserimg_card("bin.xml", "--class", "bin", "--image", "range", "--margin", "0.1", "--score", "a=1", "-q")
    (tmp_path / "bin.xml").write_bytes(CASCADE + b"<!-- trained again -->")
    assert laserimg_card("bin.xml", "--seed", "7", "--score", "b=2", "-q") == (0, "", "")
    card = read_card_of(tmp_path / "bin.xml")
    assert card is not None
    assert (card.label, card.image, card.margin, card.seed) == ("bin", "range", 0.1, 7)
    assert card.scores == {"a": 1.0, "b": 2.0}


@pytest.mark.parametrize(
    ("arguments", "code", "match"),
    [
        (["bin.xml"], 2, "a first card of bin.xml needs --class and --image"),
        (["bin.npz"], 2, "'bin.npz' does not end in .xml"),
        (
            ["bin.xml", "--class", "b", "--image", "range", "--object-size", "3"],
            2,
            "'3' is not WIDTHxHEIGHT in metres",
        ),
        (["bin.xml", "--class", "b", "--image", "range", "--score", "x"], 2, "'x' is not NAME=VALUE"),
        (["bin.xml", "--class", "b", "--image", "rang"], 1, "unknown image 'rang', did you mean 'range'?"),
        (["none.xml", "--class", "b", "--image", "range"], 1, "laserimg: none.xml: no such file"),
        (["bad.xml", "--class", "b", "--image", "range"], 1, "laserimg: bad.xml: not an XML file"),
    ],
)
def test_bad_input_writes_no_card(laserimg_card, tmp_path, arguments, code, match):
    (tmp_path / "bad.xml").write_text("no")
    got, _, err = laserimg_card(*arguments)
    assert (got, match in " ".join(err.split())) == (code, True), err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bad.xml", "bin.xml"]
