"""``laserimg classify``: which class an object is, from its range and reflectance images."""

from pathlib import Path
from typing import Annotated

import typer

from laserimg.cli.class_steps import (
    by_model,
    by_own_folds,
    chosen_recipe,
    cross_validated,
    described_objects,
    end,
    objects_in_folds,
    read_objects,
    refuse_recipe,
    table_of,
)
from laserimg.cli.class_tables import print_class_json, print_class_table

app = typer.Typer(
    name="classify",
    no_args_is_help=True,
    rich_markup_mode=None,
    help="""
Train and use a classifier of objects: HONV, HOG and 3DHOG with a linear support vector machine.

\b
  laserimg classify train objects/ --features honv+hog --size -o objects.npz
  laserimg classify evaluate objects.npz more-objects/
  laserimg classify evaluate --leave-one-out objects/ --features 3dhog
  laserimg classify predict objects.npz cloud.xyz

\b
objects/ has one folder a class, with one file an object: points (xyz, csv, txt, pcd, npz with
"points") or a range image (npz, png). A COCO file with its scans works too, and so do the data sets
that laserimg classify datasets lists, as they are downloaded.

\b
Features:
  honv        normals of the range image
  honv+hog    and gradients of the reflectance image
  3dhog       gradients of the reflectance image, laid onto the surface
  3dhog+hog   both kinds of gradients
""",
)

_FEATURES = Annotated[str, typer.Option(help="honv, honv+hog, 3dhog or 3dhog+hog.")]
_VIEWS = Annotated[int, typer.Option(min=1, max=64, help="Virtual places around a cloud (not a crop).")]
_SIZE = Annotated[bool, typer.Option("--size", help="Append height, length and breadth (not in the paper).")]
_APPEARANCE = Annotated[
    str, typer.Option(help="Image for gradients: reflectance, or range in its place (control).")
]
_SCALE = Annotated[
    float, typer.Option(min=1e-6, max=1e6, help="Metres of a unit of the points; 0.001 for millimetres.")
]
_CLASSES = Annotated[str, typer.Option(help="Classes to use, with commas. Default: all.")]
_JSON = Annotated[bool, typer.Option("--json", help="Print JSON, not a table.")]
_QUIET = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


@app.command()
def train(
    folder: Annotated[Path, typer.Argument(help="One folder a class with a file an object, or a COCO file.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Model to write (.npz).")],
    features: _FEATURES = "honv+hog",
    views: _VIEWS = 24,
    size: _SIZE = False,
    appearance: _APPEARANCE = "reflectance",
    scale: _SCALE = 1.0,
    classes: _CLASSES = "",
    margin: Annotated[
        float, typer.Option(min=0, help="Best decision value less the second, below which it is unknown.")
    ] = 0.0,
    as_json: _JSON = False,
    quiet: _QUIET = False,
) -> None:
    """Train a classifier; prints how it does on each object when that is left out.

    \b
      laserimg classify train objects/ -o objects.npz
      laserimg classify train objects/ --features 3dhog --views 4 --scale 0.001 -o objects.npz
      laserimg classify train scans.coco.json --features honv -o objects.npz
    """
    from laserimg.classify import save_model

    recipe = chosen_recipe(features, views, size, appearance)
    found = described_objects(read_objects(folder, scale, classes, quiet), recipe, quiet)
    from laserimg.classify.training import train as train_model

    trained = train_model(found.vectors, found.labels, recipe, margin)
    save_model(out, trained.model)
    table = table_of(trained.left_out, found.labels, margin)
    if as_json:
        print_class_json(
            table, {"model": str(out), "recipe": recipe.as_dict(), "method": "leave-one-out"}, found
        )
    elif not quiet:
        typer.echo(f"{len(found.labels)} objects, each classified by a machine trained without it:")
        print_class_table(table)
        typer.echo(f"model of all objects: {out}")
    end(found)


@app.command()
def evaluate(
    context: typer.Context,
    paths: Annotated[
        list[Path], typer.Argument(metavar="[MODEL] FOLDER", help="Model and objects, or objects alone.")
    ],
    leave_one_out: Annotated[
        bool, typer.Option("--leave-one-out", help="No model: train without each object in turn.")
    ] = False,
    folds: Annotated[
        int | None, typer.Option(min=2, help="No model: train without each of so many parts in turn.")
    ] = None,
    repeats: Annotated[int, typer.Option(min=1, help="Divisions into parts to average.")] = 5,
    own_folds: Annotated[
        bool, typer.Option("--own-folds", help="No model: train without each part that the data set names.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Picture of the confusion matrix (.png).")
    ] = None,
    features: _FEATURES = "honv+hog",
    views: _VIEWS = 24,
    size: _SIZE = False,
    appearance: _APPEARANCE = "reflectance",
    scale: _SCALE = 1.0,
    classes: _CLASSES = "",
    margin: Annotated[float | None, typer.Option(min=0, help="In place of the model's.")] = None,
    as_json: _JSON = False,
    quiet: _QUIET = False,
) -> None:
    """Compare a classifier with objects of known class, or a kind of classifier by leaving objects out.

    \b
      laserimg classify evaluate objects.npz more-objects/ -o confusion.png
      laserimg classify evaluate --leave-one-out objects/ --features 3dhog
      laserimg classify evaluate --folds 5 objects/ --features honv+hog --size --json
      laserimg classify evaluate --own-folds sydney-urban-objects-dataset/
    """
    ways = (leave_one_out, folds is not None, own_folds)
    cross = any(ways)
    if sum(ways) > 1:
        raise typer.BadParameter("give only one of --leave-one-out, --folds, --own-folds")
    if out is not None and out.suffix.lower() != ".png":
        raise typer.BadParameter("the picture is a .png", param_hint="--out")
    if len(paths) != 2 - cross:
        needs = "one FOLDER" if cross else "MODEL and FOLDER (or --leave-one-out, --folds, --own-folds)"
        raise typer.BadParameter(f"needs {needs}")
    if cross:
        model, recipe = None, chosen_recipe(features, views, size, appearance)
    else:
        from laserimg.classify import load_model

        refuse_recipe(context)
        model = load_model(paths[0])
        recipe = model.recipe
    sources = read_objects(paths[-1], scale, classes, quiet)
    found = described_objects(objects_in_folds(sources) if own_folds else sources, recipe, quiet)
    if model is not None:
        table, method = by_model(model, found, margin)
    elif own_folds:
        table, method = by_own_folds(found, margin or 0.0)
    else:
        table, method = cross_validated(found, folds, repeats, margin or 0.0)
    if out is not None:
        from laserimg.classify.picture import confusion_picture
        from laserimg.images import write_png

        write_png(out, confusion_picture(table))
    if as_json:
        print_class_json(table, {"recipe": recipe.as_dict(), "method": method}, found)
    elif not quiet:
        print_class_table(table)
        if out is not None:
            typer.echo(f"confusion matrix: {out}")
    end(found)


@app.command()
def predict(
    model: Annotated[Path, typer.Argument(help="Model of `laserimg classify train`.")],
    files: Annotated[list[Path], typer.Argument(help="Object clouds or crops, or folders of them.")],
    scale: _SCALE = 1.0,
    margin: Annotated[float | None, typer.Option(min=0, help="In place of the model's.")] = None,
    as_json: _JSON = False,
    quiet: _QUIET = False,
) -> None:
    """Print the class and the confidence of every object.

    \b
      laserimg classify predict objects.npz cloud.xyz
      laserimg classify predict objects.npz unknown/ --scale 0.001 --json
    """
    import json

    from laserimg.classify import load_model
    from laserimg.classify.scores import UNKNOWN
    from laserimg.classify.sources import unlabelled_sources

    loaded = load_model(model)
    found = described_objects(unlabelled_sources(files, scale), loaded.recipe, quiet, may_be_empty=True)
    verdicts = loaded.classify(found.vectors, margin)
    if as_json:
        rows = [
            {"file": name, "class": verdict.label, "confidence": round(verdict.confidence, 4)}
            for name, verdict in zip(found.names, verdicts, strict=True)
        ]
        typer.echo(json.dumps(rows, indent=1))
    elif not quiet:
        width = max((len(verdict.label) for verdict in verdicts), default=0)
        for name, verdict in zip(found.names, verdicts, strict=True):
            sure = "   -" if verdict.label == UNKNOWN else f"{verdict.confidence:.2f}"
            typer.echo(f"{verdict.label:<{width}}  {sure}  {name}")
    end(found)


@app.command()
def datasets() -> None:
    """List the public data sets whose objects are read as they are downloaded, and where they are.

    None of them ships with laserimg: mind their licences.

    \b
      laserimg classify datasets
      laserimg classify evaluate --leave-one-out kitti/training --classes car,person
      laserimg classify train SUSTechPOINTS/data/example --classes car,person,rider -o street.npz
    """
    from laserimg.classify.datasets import DATA_SETS

    for one in DATA_SETS:
        typer.echo(f"{one.name}\n  page     {one.page}\n  licence  {one.licence}\n  files    {one.files}")
