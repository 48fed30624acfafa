"""How well objects are classified, on the terminal."""

from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from laserimg.classify import ClassTable
    from laserimg.classify.sources import Described


def print_class_table(table: "ClassTable") -> None:
    """Print the paper's table: images, detected, correct, precision and recall of every class."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    grid = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("", *table.labels, "Total"):
        grid.add_column(heading, justify="right" if heading else "left")
    total = table.images.sum(), table.detected.sum(), table.correct.sum()
    for name, values, whole in zip(
        ("Images", "Detected", "Correct"), (table.images, table.detected, table.correct), total, strict=True
    ):
        grid.add_row(name, *(f"{value:.5g}" for value in values), f"{whole:.5g}")
    grid.add_row("Precision", *map(_percent, table.precision), "")
    grid.add_row("Recall", *map(_percent, table.recall), _percent(table.accuracy))
    console = Console(width=None if Console().is_terminal else 140)
    console.print(grid)
    low, high = table.interval()
    typer.echo(
        f"accuracy {table.accuracy:.1%} (95 % interval {low:.1%} to {high:.1%}), "
        f"balanced {table.balanced_accuracy:.1%}"
    )


def _percent(share: float) -> str:
    return "-" if share != share else f"{share:.1%}"


def print_class_json(table: "ClassTable", facts: dict[str, Any], found: "Described") -> None:
    """Print the table as JSON, with further facts and what failed."""
    import json

    typer.echo(json.dumps({**table.as_dict(), **facts, "failed": found.errors}, indent=1))
