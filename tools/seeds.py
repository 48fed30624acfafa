"""How far trainings of other seeds are apart: average precision, and what they find on real scans.

    laserimg train recipe training/car.toml -o seed1 --seed 1 --work simulated
    python tools/seeds.py cascades seed1 seed2

Each folder holds the detectors of one seed, simulated scans and all; a class counts in the folders that have
it. First the average precisions at IoU 0.5 of the cards, on simulated scans of other seeds; then, for each
labelled object of the real sets, which of the folders find it at the set's IoU.
"""

import argparse
import tempfile
from pathlib import Path

from laserimg.formats.card import read_card
from real_scans import HEADING, Row, measure, pipeline_of
from real_sets import SETS

SCORE = "ap50 as shipped"
REAL = ("office_room", "corridor", "staircase", "leica_ptx", "argoverse2")


def precisions(folders: list[Path]) -> dict[str, list[float]]:
    """Return the average precisions of each class, one for each folder that has it."""
    found: dict[str, list[float]] = {}
    for folder in folders:
        for path in sorted(folder.glob("*.toml")):
            card = read_card(path)
            if SCORE in card.scores:
                found.setdefault(card.label, []).append(card.scores[SCORE])
    return found


def print_precisions(folders: list[Path]) -> None:
    """Print a line for each class."""
    print(f"{'class':14}{'seeds':>6}  {'AP@0.5 of each':32}{'mean':>7}{'from':>7}{'to':>7}")
    for label, each in sorted(precisions(folders).items()):
        texts = " ".join(f"{one:.3f}" for one in each)
        mean = sum(each) / len(each)
        print(f"{label:14}{len(each):6}  {texts:32}{mean:7.3f}{min(each):7.3f}{max(each):7.3f}")


def print_real(folders: list[Path], names: tuple[str, ...]) -> None:
    """Print the rows of `real_scans.py` for each folder, of the classes that it has."""
    print(f"\n{'folder':12}{HEADING}")
    with tempfile.TemporaryDirectory() as out:
        for real in (one for one in SETS if one.name in names):
            for folder in folders:
                own = set(precisions([folder]))
                rows, missed = measure(real, pipeline_of(real, str(folder), None, Path(out)), Path(out))
                for row in rows:
                    if row.label in own and _is_asked(row):
                        print(f"{folder.name:12}{row}")
                for line in missed:
                    if any(f" {label} (" in line for label in own):
                        print(f"{'':12}{line}")


def _is_asked(row: Row) -> bool:
    return row.is_labelled or row.false_near > 0


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", type=Path, nargs="+", help="detectors, one folder a seed")
    parser.add_argument("--sets", default=",".join(REAL), help="real sets, with commas; '' for none")
    given = parser.parse_args()
    for folder in given.folders:
        if not folder.is_dir():
            parser.error(f"{folder}: no such folder")
    print_precisions(given.folders)
    if given.sets:
        print_real(given.folders, tuple(given.sets.split(",")))


if __name__ == "__main__":
    main()
