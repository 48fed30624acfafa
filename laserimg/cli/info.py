"""`laserimg info`: what a scan file holds."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from laserimg.geometry.floor import Floor
    from laserimg.scan import Scan


def info(
    paths: Annotated[list[Path], typer.Argument(help="Scan files, folders or globs.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with more figures.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Show format, grid, pitch, range, reflectance and floor of scans.

    \b
      laserimg info office.pcd
      laserimg info scans/ --json

    \b
    Figures:
      grid         rows x columns; "360" when the columns close a full turn
      pitch        degrees between neighbouring rays, across x up (median)
      returns      share of the rays that returned, within the limits of the range
      range        metres: 1 %, 50 % and 99 % of the returns
      reflectance  the sensor's own values, likewise
      floor        metres below the scanner, tilt in degrees, share of the returns
    """
    import json

    from laserimg.cli.progress import track
    from laserimg.cli.scan_files import scan_files
    from laserimg.errors import LaserImgError
    from laserimg.readers import read_file

    (files, errors), facts = scan_files(paths), []
    for file in track(files, len(files), "scans", quiet):
        try:
            facts += [_facts(scan, file) for scan in read_file(file)]
        except LaserImgError as error:
            errors.append(str(error))
    if as_json:
        typer.echo(json.dumps(facts, indent=1))
    elif facts and not quiet:
        _print_table(facts)
    for line in errors:
        typer.echo(f"laserimg: {line}", err=True)
    if errors:
        raise typer.Exit(1)


def _facts(scan: "Scan", file: Path) -> dict[str, Any]:
    import numpy as np

    from laserimg.files import without_compression
    from laserimg.geometry.floor import find_floor
    from laserimg.geometry.pitch import angular_pitch

    across, up = angular_pitch(scan)
    valid = scan.valid
    return {
        "file": str(file),
        "scan": scan.index,
        "format": without_compression(file).suffix.lower().lstrip("."),
        "rows": scan.shape[0],
        "columns": scan.shape[1],
        "wraps": scan.wraps,
        "pitch_across_deg": round(float(np.degrees(np.median(across))), 4),
        "pitch_up_deg": round(float(np.degrees(np.median(up))), 4),
        "returns": int((scan.range > 0).sum()),
        "share_of_returns": round(float(valid.mean()), 4),
        "min_range_m": scan.min_range,
        "max_range_m": scan.max_range if np.isfinite(scan.max_range) else None,
        "range_m": _quantiles(scan.range[valid]),
        "reflectance": None if scan.reflectance is None else _quantiles(scan.reflectance[valid]),
        "floor": _floor(find_floor(scan)),
        "position_m": [round(float(value), 4) for value in scan.world_from_scan[:3, 3]],
    }


def _quantiles(values: "NDArray") -> dict[str, float]:
    import numpy as np

    shares = {"min": 0, "p1": 1, "median": 50, "p99": 99, "max": 100}
    if not len(values):
        return {}
    found = np.percentile(values, list(shares.values()))
    return {name: round(float(value), 4) for name, value in zip(shares, found, strict=True)}


def _floor(floor: "Floor | None") -> dict[str, float] | None:
    if floor is None:
        return None
    return {
        "height_below_m": round(floor.height_below_m, 3),
        "tilt_deg": round(floor.tilt_deg, 2),
        "rms_m": round(floor.rms_m, 4),
        "share": round(floor.share, 3),
    }


def _print_table(facts: list[dict[str, Any]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("scan", "format", "grid", "pitch", "returns", "range", "reflectance", "floor"):
        table.add_column(heading, overflow="fold")
    for fact in facts:
        table.add_row(*_row(fact))
    Console(width=None if Console().is_terminal else 160).print(table)


def _row(fact: dict[str, Any]) -> list[str]:
    floor = fact["floor"]
    number = f" [{fact['scan']}]" if fact["scan"] else ""
    return [
        Path(fact["file"]).name + number,
        fact["format"],
        f"{fact['rows']} x {fact['columns']}" + (" 360" if fact["wraps"] else ""),
        f"{fact['pitch_across_deg']:.3f} x {fact['pitch_up_deg']:.3f}",
        f"{fact['share_of_returns']:.1%}",
        _spread(fact["range_m"], " m"),
        _spread(fact["reflectance"], ""),
        f"{floor['height_below_m']:.2f} m, {floor['tilt_deg']:.1f} deg, {floor['share']:.0%}"
        if floor
        else "none",
    ]


def _spread(found: dict[str, float] | None, unit: str) -> str:
    return f"{found['p1']:.3g} .. {found['median']:.3g} .. {found['p99']:.3g}{unit}" if found else "none"
