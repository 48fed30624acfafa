"""``laserimg rules``: show and edit the limits in metres."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import typer

from laserimg.rules.model import QUANTITIES, SHARES, SOURCES, ClassRules, Rules

DEFAULT_FILE = Path("rules.toml")
# Nothing that is looked for is as large: the limit was meant in centimetres or millimetres.
_FAR_M = 100.0
MEANINGS = {
    "region_inside": "share, continuity check",
    "region_fills": "share, continuity check",
    "score": "the detector's score must be above",
}
KEY_HELP = "\n".join(
    [
        *(f"  {q.name:<20}{f'({q.unit}) ' if q.unit else ''}{q.meaning}" for q in QUANTITIES.values()),
        *(f"  {name:<20}{MEANINGS[name]}; {value:g} when not set" for name, value in SHARES.items()),
        f"  {'from':<20}where candidates come from: {', '.join(SOURCES)}",
        f"  {'agree':<20}so many of the class's cascades must find a place (no second stage); 1 when not set",
        f"  {'on_fail':<20}what a failed check does: reject, demote (lowers a score), doubt (see file)",
    ]
)

app = typer.Typer(
    name="rules",
    no_args_is_help=True,
    rich_markup_mode=None,
    help=f"""
Show and edit the limits in metres that a detection must keep.

\b
  laserimg rules show
  laserimg rules set wastebasket.height 0.2:0.6
  laserimg rules set wastebasket.height.max 0.55
  laserimg rules unset wastebasket.points
  laserimg rules validate rules.toml

\b
Rules of a class:
{KEY_HELP}
""",
)

_FILE = typer.Option(DEFAULT_FILE, "--file", "-f", help="The rule file to edit.", show_default=True)
_QUIET = typer.Option(False, "--quiet", "-q", help="Print nothing when all is well.")


@app.command()
def show(
    file: Path | None = typer.Argument(
        None, help="Rule file; without it rules.toml here, or else the rules that ship."
    ),
    as_json: bool = typer.Option(False, "--json", help="Print JSON."),
) -> None:
    """Print the rules of every class.

    \b
      laserimg rules show
      laserimg rules show office.toml
      laserimg rules show --json
    """
    from laserimg.rules.file import load_rules

    chosen = file or (DEFAULT_FILE if DEFAULT_FILE.exists() else None)
    rules = load_rules(chosen)
    if as_json:
        import json

        print(json.dumps(_as_json(rules), indent=1))
        return
    print(rules.source if chosen else f"rules that ship with laserimg ({rules.source})")
    for one in rules:
        print(f"\n{one.label}")
        for name, text in _rows(one).items():
            print(f"  {name:<20}{text}")


@app.command(name="set", context_settings={"ignore_unknown_options": True})
def set_(
    changes: list[str] = typer.Argument(
        ..., metavar="RULE-VALUE", help="CLASS.RULE and its value; any number of such pairs."
    ),
    file: Path = _FILE,
    quiet: bool = _QUIET,
) -> None:
    """Set limits of a class.

    Comments and everything not set stay as they are, and nothing is written unless the whole file
    is valid afterwards. A class that the file does not have is added. When there is no rules.toml,
    it is made from the rules that ship.

    \b
      laserimg rules set wastebasket.height.max 0.55
      laserimg rules set wastebasket.height 0.2:0.6
      laserimg rules set car.range :30
      laserimg rules set wastebasket.from regions,clusters
      laserimg rules set bin.from regions bin.height 0.6:1.2 bin.width 0.4:0.8
    """
    from laserimg.rules.edit import set_rules

    if len(changes) % 2:
        raise typer.BadParameter(f"'{changes[-1]}' has no value", param_hint="CLASS.RULE VALUE")
    values = dict(zip(changes[::2], changes[1::2], strict=True))
    _edit(file, lambda text: set_rules(text, values, str(file)), quiet)


@app.command()
def unset(
    targets: list[str] = typer.Argument(
        ..., metavar="RULE", help="CLASS.RULE, CLASS.RULE.min, CLASS.RULE.max or CLASS; any number."
    ),
    file: Path = _FILE,
    quiet: bool = _QUIET,
) -> None:
    """Take out limits or whole classes.

    \b
      laserimg rules unset wastebasket.points
      laserimg rules unset wastebasket.height.max
      laserimg rules unset car
    """
    from laserimg.rules.edit import unset_rules

    _edit(file, lambda text: unset_rules(text, targets, str(file)), quiet)


@app.command()
def validate(
    files: list[Path] = typer.Argument(..., metavar="FILE...", help="Rule files."),
    quiet: bool = _QUIET,
) -> None:
    """Check rule files.

    A mistake is named with file and line, and the exit code is 1.

    \b
      laserimg rules validate rules.toml
    """
    import sys

    from laserimg.errors import ConfigError
    from laserimg.rules.file import load_rules

    failed = False
    for file in files:
        try:
            rules = load_rules(file)
        except ConfigError as error:
            print(f"laserimg: {error}", file=sys.stderr)
            failed = True
            continue
        if not quiet:
            print(f"{file}: valid, {', '.join(rules.labels) or 'no classes'}")
            print("".join(f"{note}\n" for one in rules for note in _notes(one)), end="")
    if failed:
        raise typer.Exit(1)


def _edit(file: Path, change: Callable[[str], str], quiet: bool) -> None:
    """Change the text of a rule file, or of the shipped one when there is none, and write it."""
    from laserimg.errors import ConfigError
    from laserimg.formats.toml import read_toml
    from laserimg.rules.file import SHIPPED, parse_rules, write_rules

    made = not file.exists()
    old = read_toml(SHIPPED if made else file).text
    try:
        new = change(old)
    except ConfigError as error:
        raise ConfigError(f"nothing changed: {error}") from None
    write_rules(file, new)
    if quiet:
        return
    if made:
        print(f"{file} made from the rules that ship; use it: laserimg detect SCAN --rules {file}")
    _print_changes(parse_rules(old), parse_rules(new, str(file)))


def _print_changes(old: Rules, new: Rules) -> None:
    for one in new:
        before = _rows(old[one.label] if one.label in old else ClassRules(one.label))
        now = _rows(one)
        changed = [name for name in {**before, **now} if before.get(name) != now.get(name)]
        for name in changed:
            print(f"{one.label}.{name}: {now.get(name, 'no limit')}")
        for note in _notes(one) if changed else ():
            print(note)
    for label in old.labels:
        if label not in new:
            print(f"{label}: no rules")


def _notes(rules: ClassRules) -> Iterator[str]:
    """Yield what is allowed and yet hardly meant."""
    from laserimg.rules.file import load_rules

    if rules.needs_detector and rules.label not in load_rules():
        yield (
            f"note: '{rules.label}' needs a detector trained for it; "
            f"to try every region: laserimg rules set {rules.label}.from regions"
        )
    for name, limit in rules.limits.items():
        if name != "points" and max(limit.low or 0, limit.high or 0) > _FAR_M:
            yield f"note: {rules.label}.{name}: {limit.format(name)}; limits are in metres"


def _rows(rules: ClassRules) -> dict[str, str]:
    """Return the rules of a class for people, by key."""
    return {
        "from": ", ".join(rules.sources),
        **{name: interval.format(name) for name, interval in rules.limits.items()},
        **{name: f"above {getattr(rules, name):g}" for name in SHARES},
        **({"agree": f"{rules.agree} cascades"} if rules.agree > 1 else {}),
        "on_fail": rules.on_fail,
    }


def _as_json(rules: Rules) -> dict[str, Any]:
    classes = {
        one.label: {
            "from": list(one.sources),
            **{name: [interval.low, interval.high] for name, interval in one.limits.items()},
            **{name: getattr(one, name) for name in SHARES},
            "agree": one.agree,
            "on_fail": one.on_fail,
        }
        for one in rules
    }
    return {"file": rules.source, "sha256": rules.sha256, "classes": classes}
