"""Rules: what limits say, and what is refused in a rule file, with the line."""

import json
import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from laserimg.errors import ConfigError
from laserimg.rules.file import SHIPPED, load_rules, parse_rules
from laserimg.rules.model import KEYS, QUANTITIES, ClassRules, Interval, Rules

metres = st.floats(0, 100).map(lambda value: round(value, 3))


@pytest.mark.parametrize(
    ("interval", "name", "value", "text"),
    [
        (Interval(0.2, 0.6), "height", 0.81, "height 0.81 m > 0.60 m"),
        (Interval(0.2, 0.6), "height", 0.1, "height 0.10 m < 0.20 m"),
        (Interval(0.2, 0.6), "height", 0.6, ""),
        (Interval(0.2, 0.6), "height", 0.2, ""),
        (Interval(30, None), "points", 12, "points 12 < 30"),
        (Interval(None, 0.605), "width", 0.61, "width 0.610 m > 0.605 m"),
        (Interval(None, 0.6), "width", 0.6004, "width 0.6004 m > 0.6000 m"),
        (Interval(-0.1, None), "height_above_floor", -0.25, "height_above_floor -0.25 m < -0.10 m"),
        (Interval(0.2, 0.6), "height", math.nan, "height not measured"),
        (Interval(None, None), "height", 5.0, ""),
    ],
)
def test_failure_says_which_limit_is_broken(interval, name, value, text):
    assert interval.failure(name, value) == text
    assert interval.contains(value) == (text == "")


@given(st.none() | metres, st.none() | metres, st.floats(0, 100))
def test_failure_is_a_true_sentence(low, high, value):
    if low is not None and high is not None and low > high:
        low, high = high, low
    text = Interval(low, high).failure("width", value)
    assert (text == "") == ((low is None or value >= low) and (high is None or value <= high))
    if text:
        measured, sign, limit = re.fullmatch(r"width (\S+) m ([<>]) (\S+) m", text).groups()
        assert float(limit) == (low if sign == "<" else high)
        near = abs(value - float(limit)) < 1e-9
        assert near or (float(measured) < float(limit) if sign == "<" else float(measured) > float(limit))


@pytest.mark.parametrize("limits", [(math.nan, 1), (0, math.inf), (2, 1)])
def test_interval_refuses_limits_that_are_none(limits):
    with pytest.raises(ConfigError, match=r"finite|above"):
        Interval(*limits)


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        ({"limits": {"heigth": Interval()}}, "unknown quantity 'heigth', did you mean 'height'"),
        ({"sources": ("region",)}, "unknown source 'region', did you mean 'regions'"),
        ({"on_fail": "drop"}, "unknown on_fail 'drop'"),
        ({"region_inside": 1.5}, "region_inside must be at least 0 and below 1"),
        ({"agree": 0}, "agree must be 1 to 99, is 0"),
    ],
)
def test_class_rules_made_in_code_are_checked(fields, match):
    with pytest.raises(ConfigError, match=match):
        ClassRules("bin", **fields)


def test_shipped_rules_are_those_of_the_paper_and_fit_the_cars_measured():
    rules = load_rules()
    wastebasket, car = rules["wastebasket"], rules["car"]
    assert wastebasket.limits["height"] == Interval(0.20, 0.60)
    assert wastebasket.limits["width"] == Interval(0.20, 0.40)
    assert wastebasket.limits["points"] == Interval(30, None)
    assert wastebasket.sources == ("cascade", "hog", "regions")
    assert (wastebasket.region_inside, wastebasket.region_fills) == (0.9, 0.5)
    for breadth, height in [(1.6, 1.3), (2.0, 1.8)]:
        assert car.limits["breadth"].contains(breadth)
        assert car.limits["height"].contains(height)
    assert rules.source == str(SHIPPED)
    assert len(rules.sha256) == 64


def test_a_rule_file_is_read_whole():
    rules = parse_rules(
        """
format = 1
[bin]
from = ["regions", "clusters"]
height = [0.2, "-"]
points = ["-", 5000]
region_inside = 0
on_fail = "demote"

["traffic light"]   # quoted
height_above_floor = [-1, 2]
"""
    )
    assert rules.labels == ("bin", "traffic light")
    assert rules["bin"] == ClassRules(
        "bin",
        ("regions", "clusters"),
        {"height": Interval(0.2, None), "points": Interval(None, 5000)},
        region_inside=0.0,
        on_fail="demote",
        line=3,
    )
    assert rules["traffic light"].limits == {"height_above_floor": Interval(-1, 2)}
    assert rules["traffic light"].sources == ("cascade", "hog")
    assert "bin" in rules
    assert "car" not in rules


WRONG = [
    ("[bin]\nheigth = [1, 2]", 3, "unknown key 'heigth', did you mean 'height'?"),
    ("[bin]\nzebra = 1", 3, "unknown key 'zebra'; known are from, width"),
    ("heigth = [1, 2]", 2, "unknown key 'heigth', did you mean 'height'?"),
    ("height = [1, 2]", 2, "'height' belongs into a class"),
    ("[bin]\n# c\nheight = [2, 1]", 4, "height: the lower limit 2 is above the upper limit 1"),
    ("[bin]\nheight = 2", 3, r'height must be \[lowest, highest\], such as \[0.20, 0.60\]; "-"'),
    ("[bin]\nheight = [1, 2, 3]", 3, "height must be"),
    ("[bin]\nheight.max = 2", 3, "height must be"),
    ("[bin]\nheight = [\n 1,\n '+']", 3, "height: '[+]' is not a number of metres"),
    ("[bin]\nheight = [true, 2]", 3, "height: true is not a number"),
    ("[bin]\nheight = [nan, 2]", 3, "height: nan is not a limit"),
    ("[bin]\nheight = [0, inf]", 3, "height: inf is not a limit"),
    ("[bin]\nheight = [0, 1e300]", 3, r"height: 1e\+300 is more than any scan holds"),
    ("[bin]\nheight = [0, 1" + "0" * 400 + "]", 3, "height: 10+ ... is more than any scan holds"),
    ("[bin]\nheight = [-0.1, 2]", 3, "height: -0.1 is below 0"),
    ("[bin]\npoints = [1.5, 2]", 3, "points: 1.5 is not a whole number"),
    ("[bin]\nfrom = 'regions'", 3, r'from must be a list such as \["cascade", "regions"\]'),
    ("[bin]\nfrom = []", 3, "from must be a list"),
    ("[bin]\nfrom = ['hog', 'hog']", 3, "from names a source twice"),
    ("[bin]\nfrom = ['cascades']", 3, "unknown source 'cascades', did you mean 'cascade'?"),
    ("[bin]\non_fail = ['reject']", 3, 'on_fail must be "reject", "demote" or "doubt"'),
    ("[bin]\nagree = 0", 3, "agree must be a whole number from 1 to 99, not 0"),
    ("[bin]\nagree = true", 3, "agree must be a whole number from 1 to 99, not true"),
    ("[bin]\nregion_fills = 1", 3, "region_fills must be a number from 0 to below 1"),
    ("[bin]\nregion_fills = nan", 3, "region_fills must be"),
    ("[bin]\nx = 1\nx = 2", 4, "a key is given twice"),
    ("[bin]\n[bin]", 3, "Cannot declare"),
    ("[bin]\nheight = [1, 2", 3, "Unclosed array"),
    ("[bin\n", 2, "Expected ']'"),
    ("['']", 2, "a class needs a name"),
    ("[[bin]]", 2, "unknown key 'bin'"),
]


@pytest.mark.parametrize(("text", "line", "match"), WRONG)
def test_mistakes_are_named_with_file_and_line(text, line, match):
    with pytest.raises(ConfigError, match=f"^r.toml:{line}: {match}"):
        parse_rules(f"format = 1\n{text}", "r.toml")


@pytest.mark.parametrize("first", ["", "format = 2", "format = true", "format = 1.0", "format = '1'"])
def test_only_format_1_is_read(first):
    with pytest.raises(ConfigError, match=r"r\.toml:1: .*format = 1"):
        parse_rules(first, "r.toml")


@pytest.mark.parametrize("text", ["a = " + "[" * 5000, "a = " + "9" * 5000])
def test_texts_that_break_parsers_are_refused(text):
    with pytest.raises(ConfigError, match=r"r\.toml: not a TOML file"):
        parse_rules(text, "r.toml")


def test_files_that_are_none_are_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.toml: no such file"):
        load_rules(tmp_path / "none.toml")
    (tmp_path / "latin.toml").write_bytes("format = 1 # ü".encode("latin-1"))
    with pytest.raises(ConfigError, match=r"latin\.toml: not UTF-8"):
        load_rules(tmp_path / "latin.toml")
    with pytest.raises(ConfigError, match="cannot be read"):
        load_rules(tmp_path)


def test_a_byte_order_mark_and_carriage_returns_are_read(tmp_path):
    path = tmp_path / "rules.toml"
    path.write_bytes("\ufeffformat = 1\r\n[bin]\r\nheight = [1, 2]\r\n".encode())
    assert load_rules(path)["bin"].limits["height"] == Interval(1, 2)


def test_a_class_needs_a_detector_or_regions():
    rules = parse_rules('format = 1\n\n[bin]\n[can]\nfrom = ["hog", "regions"]\n[cup]\n', "r.toml")
    rules.check_sources({"bin", "cup"})
    with pytest.raises(
        ConfigError, match=r'r.toml:6: class \'cup\' has no detector; .* from = \["regions"\]'
    ):
        rules.check_sources({"bin"})


def test_an_unknown_class_is_named_with_the_nearest():
    with pytest.raises(ConfigError, match="unknown class 'bim', did you mean 'bin'"):
        Rules((ClassRules("bin"),))["bim"]


labels = st.text("abc .\"'-é", min_size=1).filter(lambda text: text.strip())


@given(st.dictionaries(labels, st.sampled_from(sorted(QUANTITIES)), min_size=1), st.data())
def test_the_line_of_any_mistake_is_found(classes, data):
    """Tables in any order, comments, blank lines, arrays and strings over several lines."""
    wrong = data.draw(st.sampled_from(sorted(classes)))
    lines = ["# [bin]", "format = 1"]
    at = None
    for label, key in classes.items():
        lines += data.draw(st.lists(st.sampled_from(["", "# height = [2, 1]", "  "]), max_size=3))
        lines.append(f"[{json.dumps(label)}] # =")
        lines += data.draw(st.sampled_from([[], ["from = [", "  # ]", '  "regions",', "]"]]))
        if label == wrong:
            at = len(lines) + 1
            lines += [f"'{key}' = [ # a = 1", "  2,", "  1]"]
        else:
            lines.append(f"{key} = [1, 2]")
    with pytest.raises(ConfigError, match=f"^rules.toml:{at}: {classes[wrong]}: the lower"):
        parse_rules("\n".join(lines))


@given(st.text() | st.text("[]=\"'\n.#- 12abformatheight"))
def test_any_text_is_rules_or_a_config_error(text):
    try:
        assert isinstance(parse_rules(text), Rules)
    except ConfigError as error:
        assert str(error).startswith("rules.toml")


@pytest.mark.parametrize("key", KEYS)
def test_every_key_is_read(key):
    known = {
        "from": ('["hog"]', "sources", ("hog",)),
        "on_fail": ('"demote"', "on_fail", "demote"),
        "region_inside": ("0.5", "region_inside", 0.5),
        "region_fills": ("0.4", "region_fills", 0.4),
        "score": ("0.5", "score", 0.5),
        "agree": ("2", "agree", 2),
    }
    text, name, value = known.get(key, ("[1, 2]", "limits", {key: Interval(1, 2)}))
    (rules,) = parse_rules(f"format = 1\n[bin]\n{key} = {text}\n")
    assert getattr(rules, name) == value


def test_limits_keep_the_order_of_the_file():
    rules = parse_rules(
        "format = 1\n[bin]\npoints = [1, 2]\nheight = [1, 2]\nfrom = ['hog']\nwidth = [1, 2]\n"
    )
    assert list(rules["bin"].limits) == ["points", "height", "width"]
