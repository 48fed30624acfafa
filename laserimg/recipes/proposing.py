"""Training the cascades of a recipe, which propose boxes to its second stage."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from laserimg.cascade.features import Pool
from laserimg.cascade.folder import one_thread
from laserimg.cascade.mining import Miner
from laserimg.cascade.stage import StageGoal
from laserimg.cascade.training import Plan, Trained, Watcher, train_cascade
from laserimg.cascade.writer import write_cascade
from laserimg.errors import LabelError
from laserimg.formats.card import Card
from laserimg.recipes.cards import card_of, is_described_by, write_card_beside
from laserimg.recipes.cascade_samples import Samples, Views, no_samples, samples_of
from laserimg.recipes.drafts import Draft
from laserimg.recipes.observation import killed, observed
from laserimg.recipes.recipe import CascadeRecipe, Recipe
from laserimg.recipes.scans import TrainingScan
from laserimg.simulate.sets import Extra
from laserimg.workers import in_order

# Views have one scale: a ratio that no second level of their pyramid fits.
_ONE_SCALE = 64.0
LEAST_OBJECTS = 30
# Negatives come from at most so many scans, spread evenly; positives from all.
MOST_BACKGROUNDS = 500


def train_proposer(
    recipe: Recipe,
    cascade: CascadeRecipe,
    scans: list[TrainingScan],
    out: Draft,
    jobs: int,
    extras: tuple[Extra, ...] = (),
    tell: Callable[[int], None] = lambda done: None,
) -> Path:
    """Train a cascade and write it with its card into a draft; return its file.

    One that is there already, in the draft or in its folder, with the card that this recipe and these extras
    give it, is kept.

    Raises
    ------
    LabelError
        If the scans show too few objects.
    """
    name = f"{recipe.label}.{cascade.name}.xml"
    card = card_of(recipe, cascade, len(scans), extras)
    for kept in (out.folder / name, out.draft / name):
        if is_described_by(kept, card):
            return kept
    path = out.draft / name
    every = -(-len(scans) // MOST_BACKGROUNDS)
    samples = in_order(partial(_samples, recipe, card, every), enumerate(scans), jobs, _died, tell)
    positives = np.concatenate([one.positives for one in samples])
    if len(positives) < LEAST_OBJECTS:
        raise LabelError(
            f"{recipe.label}: {len(positives)} windows of objects in {len(scans)} scans, at least "
            f"{LEAST_OBJECTS} are needed: more scans, or another window and size"
        )
    views = Views([view for one in samples for view in one.views])
    plan, trained = _trained(recipe, cascade, positives, views, jobs)
    write_cascade(path, trained.cascade, plan.goal)
    write_card_beside(path, card, stages=len(trained.cascade))
    return path


def _samples(recipe: Recipe, card: Card, every: int, item: tuple[int, TrainingScan]) -> Samples:
    number, scan = item
    learnt, kept_out = scan.objects(recipe)
    if number % every and len(learnt) == 0:
        return no_samples(card)
    rng = np.random.default_rng([recipe.seed, number])
    with one_thread():
        return samples_of(observed(scan.path), card, learnt, kept_out, rng, views=number % every == 0)


def _died(item: tuple[int, TrainingScan]) -> Samples:
    raise killed(item[1])


def _trained(
    recipe: Recipe, cascade: CascadeRecipe, positives: np.ndarray, views: Views, jobs: int
) -> tuple[Plan, Trained]:
    goal = StageGoal(cascade.min_hit_rate, 0.5, max_trees=cascade.max_trees)
    pool = Pool(cascade.features, *cascade.window)
    plan = Plan(pool, goal, cascade.stages, 0, cascade.negatives, seed=recipe.seed)
    with one_thread(), ThreadPoolExecutor(jobs) as threads:
        miner = Miner(views, cascade.window, recipe.seed, _ONE_SCALE, False, threads)
        return plan, train_cascade(plan, positives, miner, threads, (), Watcher())
