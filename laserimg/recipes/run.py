"""From a recipe to a detector: simulate, train the cascades, train the second stage, choose its score."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from laserimg.detectors.second_stage import SecondStage, save_second_stage
from laserimg.files import atomic_write
from laserimg.recipes.cards import card_of, write_card_beside
from laserimg.recipes.drafts import Draft
from laserimg.recipes.fusing import fused
from laserimg.recipes.least_score import least_score
from laserimg.recipes.measuring import StepScore, measured
from laserimg.recipes.proposing import train_proposer
from laserimg.recipes.recipe import Recipe
from laserimg.recipes.scans import Part, TrainingScan, count_of, scans_of
from laserimg.recipes.scoring import scans_looked_at, train_second_stage
from laserimg.recipes.threshold import with_chances
from laserimg.rules.model import ClassRules
from laserimg.simulate.sets import Extra

# Given what is done and how many items it has, returns what is told of each finished item.
Steps = Callable[[str, int], AbstractContextManager[Callable[[int], None]]]


@dataclass(frozen=True, slots=True)
class TrainingRun:
    """Where and how detectors are trained.

    Parameters
    ----------
    work : Path
        Folder of simulated scans.
    out : Path
        Folder of detectors.
    jobs : int
    extras : tuple of Extra
        Things of the user that come into every scene.
    """

    work: Path
    out: Path
    jobs: int
    extras: tuple[Extra, ...] = ()

    def scans(self, recipe: Recipe, part: Part, step: Steps) -> list[TrainingScan]:
        """Return the simulated scans of a part."""
        with step(f"{recipe.label}: scans to {part}", count_of(recipe, part)) as tell:
            return scans_of(recipe, part, self.work, self.jobs, self.extras, tell)


class Outcome(NamedTuple):
    """A trained detector: from which score on its detections count, and how good it is after each step."""

    score: float
    steps: list[StepScore]


def follow(recipe: Recipe, run: TrainingRun, rules: ClassRules, step: Steps) -> Outcome:
    """Train the detector of a recipe into a folder; return how good it is on scans of other seeds.

    Parameters
    ----------
    recipe : Recipe
    run : TrainingRun
    rules : ClassRules
        What the detections must be like; their score is not asked, it is chosen.
    step : Steps

    Raises
    ------
    LabelError
        If the scans show too few objects.
    MissingExtraError
        Without Embree.
    """
    train = run.scans(recipe, "train", step)
    draft = Draft(run.out, recipe.label)
    cascades = []
    for cascade in recipe.cascades:
        with step(f"{recipe.label}: cascade {cascade.name}", len(train)) as tell:
            cascades.append(train_proposer(recipe, cascade, train, draft, run.jobs, run.extras, tell))
    with step(f"{recipe.label}: second stage", scans_looked_at(len(train))) as tell:
        card = card_of(recipe, None, len(train), run.extras)
        stage = train_second_stage(recipe, card, cascades, train, run.jobs, tell)
    tune = run.scans(recipe, "tune", step)
    with step(f"{recipe.label}: weights", len(tune)) as tell:
        stage = fused(stage, recipe, cascades, tune, run.jobs, tell)
    second = _write(stage, draft.draft / f"{recipe.label}.npz")
    models = [*cascades, second]
    with step(f"{recipe.label}: chances", len(tune)) as tell:
        stage = with_chances(stage, models, recipe, rules, tune, run.jobs, tell)
    _write(stage, second)
    with step(f"{recipe.label}: score", len(tune)) as tell:
        score = least_score(recipe, models, rules, tune, run.jobs, tell)
    models = draft.published(models)
    test = run.scans(recipe, "test", step)
    with step(f"{recipe.label}: measuring", len(test)) as tell:
        steps = measured(recipe, models, replace(rules, score=score), test, run.jobs, tell)
    outcome = Outcome(score, steps)
    write_card_beside(models[-1], stage.card, scores=_written(outcome))
    return outcome


def _write(stage: SecondStage, path: Path) -> Path:
    with atomic_write(path) as temporary:
        temporary.write_bytes(save_second_stage(stage))
    write_card_beside(path, stage.card)
    return path


def _written(outcome: Outcome) -> dict[str, float]:
    """Scores for the card."""
    steps = {f"ap50 {one.step}": round(one.average_precision, 4) for one in outcome.steps}
    return {**steps, "score": outcome.score}
