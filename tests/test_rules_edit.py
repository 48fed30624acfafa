"""Editing rules: the file stays valid, says what was asked, and keeps every other byte."""

import json
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from laserimg.cli import main
from laserimg.errors import ConfigError
from laserimg.formats.toml import statements
from laserimg.rules.edit import set_rules, unset_rules
from laserimg.rules.file import SHIPPED, parse_rules
from laserimg.rules.model import ON_FAIL, QUANTITIES, SHARES, SOURCES

HAND_WRITTEN = """# My office.
format = 1

  [bin]   # the round ones
  height = [   # of the rim
    0.2,  # low
    0.6   # high
  ]
  points = [30,"-"] # a count

# Nothing about cars yet.
["traffic light"]
from = ['regions']
# the end"""
FILES = [SHIPPED.read_text(), HAND_WRITTEN, "format = 1\r\n[bin]\r\n\r\n# end\r\n"]
DEFAULTS = {"from": ("cascade", "hog"), "on_fail": "reject", "agree": 1, **SHARES}

Model = dict[str, dict[str, object]]


def as_model(text: str) -> Model:
    """The file as plain data: class, key, value."""
    return {
        one.label: {name: (limit.low, limit.high) for name, limit in one.limits.items()}
        | {"from": one.sources, "on_fail": one.on_fail, "agree": one.agree}
        | {name: getattr(one, name) for name in SHARES}
        for one in parse_rules(text)
    }


def as_value(key: str, text: str):
    if key == "from":
        return tuple(text.split(","))
    if key == "agree":
        return int(text)
    if key in SHARES:
        return float(text)
    if key in QUANTITIES:
        return tuple(None if side in ("", "-") else float(side) for side in text.split(":"))
    return text


def set_in_model(model: Model, label: str, key: str, end: str, text: str) -> None:
    rules = model.setdefault(label, dict(DEFAULTS))
    if end:
        low, high = rules.get(key, (None, None))
        rules[key] = (float(text), high) if end == "min" else (low, float(text))
    else:
        rules[key] = as_value(key, text)


def unset_in_model(model: Model, label: str, key: str, end: str) -> None:
    if key not in QUANTITIES:
        model[label][key] = DEFAULTS[key]
        return
    low, high = model[label].pop(key)
    rest = (None, high) if end == "min" else (low, None)
    if end and rest != (None, None):
        model[label][key] = rest


def is_valid(model: Model) -> bool:
    pairs = [rules[key] for rules in model.values() for key in QUANTITIES if key in rules]
    return all(None in pair or pair[0] <= pair[1] for pair in pairs) and (None, None) not in pairs


def without_rule(text: str, label: str, key: str) -> list[str]:
    """The lines of a file that an edit of this rule must not touch."""
    lines = text.removesuffix("\n").splitlines()
    for one in reversed(statements(text)):
        if one.keys == (label, key):
            del lines[one.first : one.last]
    return lines


label = st.sampled_from(["bin", "traffic light", "wastebasket", "a.b"])
quantity = st.sampled_from(sorted(QUANTITIES))
number = st.integers(0, 20).map(str)
side = st.sampled_from(["", "-"]) | number
names = st.lists(st.sampled_from(SOURCES), min_size=1, unique=True).map(",".join)
setting = st.one_of(
    st.tuples(quantity, st.just(""), st.tuples(side, side).map(":".join)),
    st.tuples(quantity, st.sampled_from(["min", "max"]), number),
    st.tuples(st.just("from"), st.just(""), names),
    st.tuples(st.sampled_from(sorted(SHARES)), st.just(""), st.sampled_from(["0.25", "0"])),
    st.tuples(st.just("agree"), st.just(""), st.integers(1, 5).map(str)),
    st.tuples(st.just("on_fail"), st.just(""), st.sampled_from(ON_FAIL)),
)


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(FILES), st.lists(st.tuples(label, setting, st.booleans()), max_size=8))
def test_any_sequence_of_edits_equals_the_edits_of_the_model(text, changes):
    for name, (key, end, value), is_set in changes:
        rule = f"{name}.{key}.{end}".removesuffix(".")
        model = as_model(text)
        there = any(one.keys == (name, key) for one in statements(text))
        if is_set:
            set_in_model(model, name, key, end, value)
        elif there:
            unset_in_model(model, name, key, end)
        if not is_valid(model) or not (is_set or there):
            with pytest.raises(ConfigError, match=r"above|no rule"):
                set_rules(text, {rule: value}) if is_set else unset_rules(text, [rule])
            continue
        edited = set_rules(text, {rule: value}) if is_set else unset_rules(text, [rule])
        assert as_model(edited) == model
        rest = without_rule(edited, name, key)
        assert rest[: len(without_rule(text, name, key))] == without_rule(text, name, key)
        assert [
            line for line in rest[len(without_rule(text, name, key)) :] if line not in ("", *headers(name))
        ] == []
        text = edited


def headers(label: str) -> list[str]:
    return [f"[{label}]", f"[{json.dumps(label)}]"]


def test_one_side_of_an_array_over_several_lines_keeps_its_comments():
    edited = set_rules(HAND_WRITTEN, {"bin.height.max": "0.550"})
    assert edited == HAND_WRITTEN.replace("0.6 ", "0.550 ") + "\n"


def test_a_new_rule_stands_with_its_class_not_below_the_comment_of_the_next():
    edited = set_rules(HAND_WRITTEN, {"bin.width": "0.20:0.40"})
    assert "# a count\n  width = [0.20, 0.40]\n\n# Nothing" in edited


def test_a_new_class_is_appended():
    edited = set_rules("format = 1", {"traffic light.from": "regions", "traffic light.height.max": ".5"})
    assert edited == 'format = 1\n\n["traffic light"]\nfrom = ["regions"]\nheight = ["-", 0.5]\n'


def test_a_class_goes_with_its_comments():
    edited = unset_rules(HAND_WRITTEN, ["bin"])
    assert (
        edited
        == HAND_WRITTEN[: HAND_WRITTEN.index("\n  [bin]")]
        + HAND_WRITTEN[HAND_WRITTEN.index("\n# Nothing") :]
        + "\n"
    )


def test_a_class_set_and_unset_leaves_the_file_as_it_was():
    text = SHIPPED.read_text()
    assert unset_rules(set_rules(text, {"bin.from": "regions", "bin.range.max": "20"}), ["bin"]) == text


def test_a_rule_without_either_side_is_gone():
    edited = unset_rules(HAND_WRITTEN, ["bin.points.max", "bin.height.min"])
    assert as_model(edited)["bin"]["points"] == (30, None)
    assert "points" not in unset_rules(edited, ["bin.points.min"])
    assert "height" not in as_model(unset_rules(edited, ["bin.height.max"]))["bin"]


def test_limits_may_cross_on_the_way():
    edited = set_rules(HAND_WRITTEN, {"bin.height.min": "0.7", "bin.height.max": "0.9"})
    assert parse_rules(edited)["bin"].limits["height"].failure("height", 0.8) == ""


def test_line_ends_of_windows_stay():
    edited = set_rules(
        "format = 1\r\n[bin]\r\nheight = [1, 2] # c\r\n", {"bin.height.max": "3", "can.from": "regions"}
    )
    assert edited == 'format = 1\r\n[bin]\r\nheight = [1, 3] # c\r\n\r\n[can]\r\nfrom = ["regions"]\r\n'


@pytest.mark.parametrize(
    ("rule", "value", "match"),
    [
        ("bin.heigth", "1:2", "unknown key 'heigth', did you mean 'height'"),
        ("bin", "1:2", "name a class and a rule, such as bin.height"),
        ("height", "1:2", "such as wastebasket.height"),
        (".height", "1:2", "such as wastebasket.height"),
        ("", "1:2", "such as wastebasket.height"),
        ("bin.height", "0.5", r"bin.height takes LOWEST:HIGHEST, .* set bin.height.min or bin.height.max"),
        ("bin.height", ":", "unset it instead"),
        ("bin.height.max", "0.5m", "'0.5m' is not a number; lengths are in metres"),
        ("bin.height.max", "nan", "'nan' is not a number"),
        ("bin.height.max", "1e3", "'1e3' is not a number"),
        ("bin.height.max", "1]\nx = [1", "is not a number"),
        ("bin.height.max", "0.1", "lower limit 0.2 is above the upper limit 0.1"),
        ("bin.height.min", "-1", "-1 is below 0"),
        ("bin.points.max", "30.5", "30.5 is not a whole number"),
        ("bin.from.max", "1", "unknown quantity 'from'"),
        ("bin.from", "region", "unknown source 'region', did you mean 'regions'"),
        ("bin.from", "", "unknown source ''"),
        ("bin.on_fail", 'x"\ny = 1', "on_fail must be"),
        ("bin.region_fills", "1.5", "region_fills must be a number from 0 to below 1"),
        ("\n.height", "1:2", "a class needs a name that can be read"),
    ],
)
def test_edits_that_make_no_sense_are_refused(rule, value, match):
    with pytest.raises(ConfigError, match=match):
        set_rules(HAND_WRITTEN, {rule: value})


@pytest.mark.parametrize(
    ("rule", "match"),
    [
        ("bin.width", "has no rule bin.width"),
        ("car.width", "has no rule car.width"),
        ("bun", "unknown class 'bun', did you mean 'bin'"),
        ("bin.heigth", "unknown key 'heigth'"),
    ],
)
def test_what_is_not_there_cannot_be_unset(rule, match):
    with pytest.raises(ConfigError, match=match):
        unset_rules(HAND_WRITTEN, [rule])


def test_a_class_in_one_line_is_read_but_not_edited():
    text = "format = 1\nbin = {height = [1, 2]}\n"
    assert as_model(text)["bin"]["height"] == (1, 2)
    with pytest.raises(ConfigError, match=r"under a line \[bin\]"):
        set_rules(text, {"bin.height.max": "3"})


@pytest.fixture
def laserimg(tmp_path, monkeypatch, capsys):
    """Run the command line in an empty folder: exit code, output, errors."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["laserimg", "rules", *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        return stop.value.code or 0, *capsys.readouterr()

    return run


def test_set_makes_the_file_from_the_shipped_rules_and_says_so(laserimg, tmp_path):
    code, out, _ = laserimg("set", "wastebasket.height.max", "0.55", "car.range.max", "30")
    assert code == 0
    assert out.splitlines() == [
        "rules.toml made from the rules that ship; use it: laserimg detect SCAN --rules rules.toml",
        "wastebasket.height: 0.20 m to 0.55 m",
        "car.range: 30.00 m or less",
    ]
    text = (tmp_path / "rules.toml").read_text()
    assert text == SHIPPED.read_text().replace("0.60]", "0.55]", 1).replace(
        '[50, "-"]', '[50, "-"]\nrange = ["-", 30]', 1
    )


def test_set_then_show_gives_what_was_set(laserimg):
    laserimg("set", "bin.from", "regions", "bin.height", "0.6:1.2", "bin.points", "100:", "--file", "my.toml")
    code, out, _ = laserimg("show", "my.toml", "--json")
    shown = json.loads(out)
    assert (code, shown["file"]) == (0, "my.toml")
    assert shown["classes"]["bin"] == {
        "from": ["regions"],
        "height": [0.6, 1.2],
        "points": [100, None],
        "region_inside": 0.9,
        "region_fills": 0.5,
        "score": 0.0,
        "agree": 1,
        "on_fail": "reject",
    }
    assert (
        "  height              0.60 m to 1.20 m\n  points              100 or more\n"
        in laserimg("show", "my.toml")[1]
    )


def test_show_without_a_file_takes_the_one_here_or_the_shipped(laserimg):
    assert laserimg("show")[1].startswith("rules that ship with laserimg (")
    laserimg("unset", "car", "-q")
    assert laserimg("show")[1].startswith("rules.toml\n\nwastebasket\n  from ")
    assert "car" not in laserimg("show")[1]


def test_a_class_that_needs_a_detector_is_noted(laserimg):
    assert "note: 'bin' needs a detector trained for it" in laserimg("set", "bin.height", "0.6:1.2")[1]
    assert "note" not in laserimg("set", "bin.from", "regions")[1]


def test_limits_below_0_are_not_taken_for_options(laserimg):
    code, out, _ = laserimg("set", "car.height_above_floor.min", "-0.1")
    assert (code, out.splitlines()[1]) == (0, "car.height_above_floor: -0.10 m to 0.50 m")


def test_a_refused_edit_leaves_the_file_as_it_is(laserimg, tmp_path):
    laserimg("set", "wastebasket.height.max", "0.55")
    before = (tmp_path / "rules.toml").read_bytes()
    code, out, err = laserimg("set", "wastebasket.height.max", "0.1")
    assert (code, out) == (1, "")
    line = before.decode().splitlines().index("height = [0.20, 0.55]") + 1
    assert err == (
        f"laserimg: nothing changed: rules.toml:{line}: height: "
        "the lower limit 0.2 is above the upper limit 0.1\n"
    )
    assert (tmp_path / "rules.toml").read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["rules.toml"]


def test_a_name_without_a_value_is_wrong_usage(laserimg, tmp_path):
    code, _, err = laserimg("set", "wastebasket.height.max")
    assert code == 2
    assert "'wastebasket.height.max' has no value" in err
    assert list(tmp_path.iterdir()) == []


def test_validate_names_every_file_that_is_wrong(laserimg, tmp_path):
    (tmp_path / "good.toml").write_text(HAND_WRITTEN)
    (tmp_path / "bad.toml").write_text("format = 1\n[bin]\nheigth = [1, 2]\n")
    code, out, err = laserimg("validate", "bad.toml", "good.toml", "none.toml")
    assert code == 1
    assert out.splitlines() == [
        "good.toml: valid, bin, traffic light",
        "note: 'bin' needs a detector trained for it; "
        "to try every region: laserimg rules set bin.from regions",
    ]
    assert err.splitlines() == [
        "laserimg: bad.toml:3: unknown key 'heigth', did you mean 'height'?",
        "laserimg: none.toml: no such file",
    ]
    assert laserimg("validate", "good.toml", "-q") == (0, "", "")


def test_help_names_every_rule_and_shows_examples_first(laserimg):
    text = laserimg("--help")[1]
    for name in (*QUANTITIES, *SHARES, "from", "agree", "on_fail"):
        assert f"\n    {name} " in text
    assert text.index("laserimg rules set wastebasket.height 0.2:0.6") < text.index("Rules of a class")


def test_notes_name_what_is_hardly_meant(laserimg):
    """A class that no detector finds, and limits in millimetres; not what ships with detectors."""
    laserimg("set", "wastebasket.height", "0.2:0.5", "crate.width", "0.2:0.5")
    _, out, _ = laserimg("validate", "rules.toml")
    assert out.count("note:") == 1 and "note: 'crate' needs a detector" in out
    _, out, _ = laserimg("set", "wastebasket.height", "200:600")
    assert "note: wastebasket.height: 200.00 m to 600.00 m; limits are in metres" in out
