"""The state of a training run on disk: a file a stage, written whole; a killed run goes on from it."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.model import Stage, Tree
from laserimg.cascade.rates import Rate
from laserimg.errors import ConfigError, ModelError
from laserimg.files import atomic_write, write_text

_NODE_ARRAYS = ("features", "thresholds", "subsets", "children")


@dataclass(frozen=True)
class StageRecord:
    """What is known of a stage after its training.

    Attributes
    ----------
    number : int
        From 0.
    trees : int
    hit_rate, false_alarm : float
        Of the stage alone, on its own positives and negatives.
    positives, negatives : int
        Samples it was trained on.
    positives_left : int
        Positives that pass all stages so far, of all given.
    before : Rate
        False alarms per window of the stages before it, counted while its negatives were looked for.
    mining_s, training_s : float
        Seconds.
    """

    number: int
    trees: int
    hit_rate: float
    false_alarm: float
    positives: int
    negatives: int
    positives_left: int
    before: Rate
    mining_s: float
    training_s: float

    @property
    def rate(self) -> float:
        """False alarms per window of all stages so far, expected from the stage's own rate."""
        return self.before.value * self.false_alarm


@dataclass(frozen=True, eq=False, slots=True)
class StageState:
    """A trained stage and what the next one begins with.

    Attributes
    ----------
    stage : Stage
    record : StageRecord
    negatives : (n, height, width) uint8
        Negatives of this stage that pass it.
    """

    stage: Stage
    record: StageRecord
    negatives: NDArray[np.uint8]


class Checkpoints:
    """The folder ``state`` of a run.

    Parameters
    ----------
    folder : Path
    identity : dict
        Everything that the result depends on; a run with another identity does not go on from this state.
    """

    def __init__(self, folder: Path, identity: dict) -> None:
        self._folder = folder
        self._identity = json.dumps(identity, sort_keys=True, indent=1)

    def load(self) -> list[StageState]:
        """Return the whole stages of an earlier run of the same identity.

        Raises
        ------
        ConfigError
            If the folder holds the state of a run with other settings or samples.
        ModelError
            If a file is damaged.
        """
        told = self._folder / "run.json"
        if not told.exists():
            return []
        if told.read_text(encoding="utf-8") != self._identity:
            raise ConfigError(
                f"{self._folder} is the state of a run with other settings or samples: "
                "give the same ones, another output folder, or --restart"
            )
        states = []
        while (path := self._path(len(states))).exists():
            states.append(read_state(path))
        return states

    def begin(self) -> None:
        """Forget the state of any earlier run."""
        for path in self._folder.glob("stage_*.npz"):
            path.unlink()
        write_text(self._folder / "run.json", self._identity)

    def save(self, state: StageState) -> None:
        """Write one stage whole or not at all."""
        with atomic_write(self._path(state.record.number)) as temporary, temporary.open("wb") as file:
            np.savez(file, allow_pickle=False, **_arrays(state))

    def _path(self, number: int) -> Path:
        return self._folder / f"stage_{number:02d}.npz"


def _arrays(state: StageState) -> dict[str, Any]:
    trees = state.stage.trees
    return {
        "record": np.frombuffer(json.dumps(asdict(state.record)).encode(), np.uint8),
        "negatives": state.negatives,
        "threshold": np.array([state.stage.threshold], np.float32),
        "nodes": np.array([len(tree.features) for tree in trees]),
        "leaves": np.concatenate([tree.leaves for tree in trees]),
        **{name: np.concatenate([getattr(tree, name) for tree in trees]) for name in _NODE_ARRAYS},
    }


def read_state(path: Path) -> StageState:
    """Return one stage from its file.

    Raises
    ------
    ModelError
        If the file is damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        facts = json.loads(arrays["record"].tobytes())
        record = StageRecord(**{**facts, "before": Rate(**facts["before"])})
        cuts = np.cumsum(arrays["nodes"])[:-1]
        parts = [np.split(arrays[name], cuts) for name in _NODE_ARRAYS]
        leaves = np.split(arrays["leaves"], cuts + np.arange(1, len(cuts) + 1))
        trees = tuple(Tree(*arrays_of_tree) for arrays_of_tree in zip(*parts, leaves, strict=True))
        return StageState(Stage(trees, arrays["threshold"][0]), record, arrays["negatives"])
    except (OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile) as error:
        raise ModelError(
            f"{path}: damaged checkpoint ({error}); remove it to train this stage again"
        ) from None
