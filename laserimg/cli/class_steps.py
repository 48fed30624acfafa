"""The steps that the commands of `laserimg classify` share: read objects, describe them, compare them."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from laserimg.classify import ClassTable, ObjectModel, Recipe
    from laserimg.classify.sources import Described, Source


def chosen_recipe(features: str, views: int, size: bool, appearance: str) -> "Recipe":
    """Return how objects are described, by the options of a command."""
    from laserimg.classify import Recipe
    from laserimg.errors import ConfigError

    try:
        return Recipe.from_dict(
            {"features": features, "views": views, "size": size, "appearance": appearance}
        )
    except ConfigError as error:
        raise typer.BadParameter(str(error)) from None


def refuse_recipe(context: typer.Context) -> None:
    """A model says itself how objects are described."""
    for name in ("features", "views", "size", "appearance"):
        source = context.get_parameter_source(name)
        if source is not None and source.name != "DEFAULT":
            raise typer.BadParameter("a model has its own; give it to `train`", param_hint=f"--{name}")


def read_objects(folder: Path, scale: float, classes: str, quiet: bool) -> list["Source"]:
    """Return the objects of a folder, a COCO file or a data set, of all classes or of those named."""
    from laserimg.classify.sources import labelled_sources
    from laserimg.cli.progress import track

    found = labelled_sources(folder, scale, lambda files: track(files, len(files), "reading", quiet))
    if not classes:
        return found
    wanted = [name.strip() for name in classes.split(",")]
    known = {source.label for source in found}
    if missing := [name for name in wanted if name not in known]:
        raise typer.BadParameter(
            f"no object is of class {missing[0]}; there are {', '.join(sorted(known))}",
            param_hint="--classes",
        )
    return [source for source in found if source.label in wanted]


def objects_in_folds(sources: list["Source"]) -> list["Source"]:
    """Return the objects that the data set has put into folds."""
    from laserimg.errors import LabelError

    found = [source for source in sources if source.fold >= 0]
    if not found:
        raise LabelError("these objects come without folds; give --folds 5, for example")
    return found


def by_model(model: "ObjectModel", found: "Described", margin: float | None) -> tuple["ClassTable", str]:
    """Return the table of a model, and what to call it."""
    from laserimg.classify import class_table

    verdicts = model.classify(found.vectors, margin)
    return class_table(found.labels, _class_names(verdicts), model.labels), "model"


def by_own_folds(found: "Described", margin: float) -> tuple["ClassTable", str]:
    """Return the table of the folds of the data set, and what to call it."""
    from laserimg.classify.validation import given_folds

    decisions = given_folds(found.vectors, found.labels, found.folds)
    return table_of(decisions, found.labels, margin), "folds of the data set"


def described_objects(
    sources: list["Source"], recipe: "Recipe", quiet: bool, may_be_empty: bool = False
) -> "Described":
    """Describe objects; what cannot be is told."""
    from laserimg.classify.sources import described
    from laserimg.cli.progress import track
    from laserimg.errors import LabelError

    found = described(track(sources, len(sources), "describing", quiet), recipe)
    if not len(found.labels) and not may_be_empty:
        raise LabelError(f"none of {len(sources)} objects can be described; {found.errors[0]}")
    for line in found.errors:
        typer.echo(f"laserimg: {line}", err=True)
    return found


def cross_validated(
    found: "Described", folds: int | None, repeats: int, margin: float
) -> tuple["ClassTable", str]:
    """Return the table of leave-one-out (no folds) or of repeated folds, and what to call it."""
    from laserimg.classify.validation import leave_one_out, repeated_folds

    if folds is None:
        decisions: Any = leave_one_out(found.vectors, found.labels)
        return table_of(decisions, found.labels, margin), "leave-one-out"
    runs = repeated_folds(found.vectors, found.labels, folds, repeats)
    return table_of(runs, found.labels, margin), f"{folds} folds, {repeats} times"


def table_of(decisions: Any, labels: Any, margin: float) -> "ClassTable":
    """Return the table of decision values, of one run or of several."""
    import numpy as np

    from laserimg.classify import class_table
    from laserimg.classify.model import verdicts

    classes = tuple(np.unique(labels).tolist())
    runs = decisions if isinstance(decisions, list) else [decisions]
    return class_table(labels, [_class_names(verdicts(run, classes, margin=margin)) for run in runs])


def _class_names(verdicts: Iterable[Any]) -> Any:
    """Return the classes of verdicts as an array."""
    import numpy as np

    return np.array([verdict.label for verdict in verdicts], dtype=np.str_)


def end(found: "Described") -> None:
    """Exit with 1 if some objects could not be described."""
    if found.errors:
        raise typer.Exit(1)
