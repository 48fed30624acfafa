"""Cards of detectors trained on simulated scans."""

import json
from collections.abc import Iterable
from dataclasses import asdict, replace
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cv2

import laserimg.simulate
from laserimg.detectors.description import SIDE
from laserimg.errors import ModelError
from laserimg.files import sources_sha256
from laserimg.formats.card import Card, card_path, file_sha256, read_card_of, write_card
from laserimg.recipes.recipe import CascadeRecipe, Recipe
from laserimg.simulate.sets import Extra
from laserimg.simulate.user_mesh import UserThing

_NO_FILE = "0" * 64
_SIMULATOR = Path(laserimg.simulate.__file__).parent


def card_of(
    recipe: Recipe,
    cascade: CascadeRecipe | None,
    scans: int,
    extras: Iterable[Extra] = (),
    simulator: str | None = None,
) -> Card:
    """Return the card of a cascade, or of the second stage, before its file is written.

    Parameters
    ----------
    recipe : Recipe
    cascade : CascadeRecipe or None
        None for the second stage.
    scans : int
        Simulated scans it is trained on.
    extras : iterable of Extra
        Things of the user in them.
    simulator : str, optional
        Digest of the simulator that made them; by default this one.
    """
    extras, simulator = tuple(extras), simulator or sources_sha256(_SIMULATOR)
    common: dict[str, Any] = {
        "label": recipe.label,
        "sha256": _NO_FILE,
        "trained_on": _trained_on(recipe, scans, extras),
        "seed": recipe.seed,
        "recipe_sha256": _digest(recipe, cascade, extras, simulator),
        "licence": recipe.licence,
        "versions": {"laserimg": version("laserimg"), "opencv": cv2.__version__, "simulator": simulator},
    }
    if cascade is None:
        return Card(kind="svm", image="normals_view", window=(SIDE, SIDE), **common)
    return Card(
        kind="haar",
        image=cascade.image,
        window=cascade.window,
        object_size_m=cascade.object_size_m,
        margin=cascade.margin,
        **common,
    )


def _trained_on(recipe: Recipe, scans: int, extras: Iterable[Extra]) -> str:
    """What was learnt from, with the digest of each mesh file in it."""
    scenes = ", ".join(sorted({f"{one.scene} by {one.scanner}" for one in recipe.scans}))
    meshes = [
        f"with {one.path.name} (sha256 {file_sha256(one.path)})"
        for one in extras
        if isinstance(one, UserThing)
    ]
    return "; ".join([f"{scans} simulated scans: {scenes}", *meshes])


def _digest(recipe: Recipe, cascade: CascadeRecipe | None, extras: Iterable[Extra], simulator: str) -> str:
    """SHA-256 of what a cascade depends on, without what comes after it; of a second stage, of all."""
    if cascade is None:
        parts = asdict(replace(recipe, licence=""))
    else:
        parts = {
            "class": recipe.label,
            "scans": [asdict(one) for one in recipe.scans],
            "cascade": asdict(cascade),
            "seed": recipe.seed,
            "neutral": sorted(recipe.neutral),
            "min_points": recipe.min_points,
            "min_visibility": recipe.min_visibility,
        }
    parts |= {"extras": [one.tag for one in extras], "simulator": simulator}
    return sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def is_described_by(path: Path, card: Card) -> bool:
    """Whether a cascade is there, unchanged, whose card says the same but for what training found out."""
    try:
        old = read_card_of(path) if path.exists() else None
    except ModelError:
        return False
    return old is not None and replace(old, sha256=card.sha256, stages=card.stages) == card


def write_card_beside(path: Path, card: Card, **known: Any) -> None:
    """Write the card of a file that is there now."""
    write_card(card_path(path), replace(card, sha256=file_sha256(path), **known))
