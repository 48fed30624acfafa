"""How the time and memory of training grow with samples and features.

    python tools/training_growth.py FACES

FACES holds posN_train.vec and backgrounds.txt (N = 20 and 24). Each row is one cold `laserimg train
cascade` of 10 stages in a fresh process.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STAGES = 10
# Window, features, how many there are, positives, negatives.
ROWS = [
    (20, "basic", 78_460, 500, 1000),
    (20, "basic", 78_460, 1000, 2000),
    (20, "basic", 78_460, 1000, 4000),
    (20, "basic", 78_460, 1000, 8000),
    (20, "core", 101_329, 1000, 2000),
    (20, "all", 125_199, 1000, 2000),
    (24, "basic", 162_336, 1000, 2000),
    (24, "all", 261_600, 1000, 2000),
    (24, "all", 261_600, 1000, 8000),
    (20, "lbp", 3_969, 1000, 2000),
]


def train(
    faces: Path, size: int, features: str, positives: int, negatives: int
) -> tuple[float, float, float]:
    """Train once; return wall seconds, processor seconds and peak MB."""
    with tempfile.TemporaryDirectory() as out:
        options = [
            *("--positives", faces / f"pos{size}_train.vec", "--negatives", faces / "backgrounds.txt"),
            *("--window", f"{size}x{size}", "--features", features, "--stages", STAGES),
            *("--num-pos", positives, "--num-neg", negatives, "--quiet", "--out", out),
        ]
        command = [sys.executable, "-m", "laserimg", "train", "cascade", *map(str, options)]
        start = time.perf_counter()
        process = subprocess.Popen(command)
        _, status, usage = os.wait4(process.pid, 0)
        if status:
            sys.exit(f"training ended with status {status}")
    unit = 1 if sys.platform == "darwin" else 1024
    seconds = usage.ru_utime + usage.ru_stime
    return time.perf_counter() - start, seconds, usage.ru_maxrss * unit / 1e6


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("faces", type=Path)
    faces = parser.parse_args().faces
    print("| window | features | positives + negatives | wall | processor | peak memory |")
    print("|---|---|---|---|---|---|")
    for size, features, count, positives, negatives in ROWS:
        wall, processor, memory = train(faces, size, features, positives, negatives)
        print(
            f"| {size}x{size} | {features}, {count:,d} | {positives} + {negatives} "
            f"| {wall:.1f} s | {processor:.1f} s | {memory:.0f} MB |",
            flush=True,
        )


if __name__ == "__main__":
    main()
