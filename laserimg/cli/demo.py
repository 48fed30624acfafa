"""``laserimg demo``: the main job on the scans that ship with the package."""

from pathlib import Path
from typing import Annotated

import typer


def demo(
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for scans and results.")] = Path(
        "laserimg-demo"
    ),
    as_json: Annotated[bool, typer.Option("--json", help="Print detections.json, not a table.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Find objects in two scans that ship with laserimg.

    The scans, an office and a street, are simulated. They are written to the folder, and
    `laserimg detect` runs on them with the shipped rules alone (--cascades none).

    \b
      laserimg demo
      laserimg demo -o somewhere
    """
    import laserimg
    from laserimg.cli.detect import detect
    from laserimg.files import atomic_write

    scans = sorted((Path(laserimg.__file__).parent / "demo").glob("*.npz"))
    for scan in scans:
        with atomic_write(out / scan.name) as temporary:
            temporary.write_bytes(scan.read_bytes())
    results = out / "results"
    # Rules alone give each rejected object a reason in metres; the trained detectors are what comes next.
    detect([out / scan.name for scan in scans], results, cascades="none", as_json=as_json, quiet=quiet)
    if quiet or as_json:
        return
    print(f"\n  {'scans':<12}{out}")
    print(f"  {'pictures':<12}{results / 'overlays'}")
    print(f"  {'detections':<12}{results / 'detections.json'} and .csv")
    print(f"  {'next':<12}laserimg show {out / scans[0].name}")
    print(f"  {'':<12}laserimg detect {out} -o out     (all nine trained detectors)")
