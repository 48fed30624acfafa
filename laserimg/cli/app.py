"""The verbs of the command line, in the order of their help."""

import typer

import laserimg
from laserimg.cli import (
    card,
    classify,
    convert,
    demo,
    detect,
    evaluate,
    images,
    info,
    map,
    rules,
    samples,
    show,
    simulate,
    train,
    train_from_mesh,
    train_hog,
    train_recipe,
    truth,
)

app = typer.Typer(
    name="laserimg",
    help="A laser scan is an image: find objects in 3D laser scans, with their size in metres.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _version(asked: bool) -> None:
    if asked:
        print(laserimg.__version__)
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version."
    ),
) -> None:
    pass


app.command()(demo.demo)
app.command()(detect.detect)
app.command()(show.show)
app.command()(evaluate.evaluate)
app.command()(truth.truth)
app.add_typer(rules.app)
app.add_typer(classify.app)
app.command()(card.card)
app.command("map")(map.map_)
app.command()(info.info)
app.command()(convert.convert)
app.command()(images.images)
train.app.command()(train_hog.hog)
train.app.command()(train_recipe.recipe)
train.app.command("from-mesh")(train_from_mesh.from_mesh)
app.add_typer(train.app)
app.command()(samples.samples)
app.command()(simulate.simulate)
