"""How a checkpoint was trained, from the files that LeRobot keeps with it."""

import math
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from lerobot_excav.datasets.format.validated import validated_file
from lerobot_excav.evaluation.training_log import read_training_log

FACTS = "training.json"
"""File of an exported checkpoint in which its `TrainingFacts` are kept."""


class TrainingFacts(BaseModel):
    """Facts of a training up to one checkpoint; None where no file tells."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str  # of the training's folder
    dataset: str  # name of its folder
    demonstrations: int | None  # episodes given to the training, the held-out ones among them
    held_out: int  # episodes of them that it did not learn from
    steps: int | None  # up to the checkpoint
    batch_size: int  # samples per step
    seed: int | None
    minutes: float | None  # up to the checkpoint
    command: str | None
    commit: str | None

    @property
    def samples(self) -> int | None:
        """Samples seen up to the checkpoint."""
        return None if self.steps is None else self.steps * self.batch_size


class _Dataset(BaseModel):
    repo_id: str
    root: str | None = None
    episodes: list[int] | None = None
    eval_split: float = 0.0


class _TrainConfig(BaseModel):
    """What is needed of LeRobot's `train_config.json`."""

    dataset: _Dataset
    batch_size: int
    seed: int | None = None


class _Step(BaseModel):
    step: int


class _DatasetInfo(BaseModel):
    total_episodes: int


def read_training(pretrained: Path) -> TrainingFacts | None:
    """Read how the checkpoint `TRAINING/checkpoints/STEP/pretrained_model` was trained; its log is `TRAINING.log`.

    An exported checkpoint has kept it. None if the folder is neither, or is gone.

    Raises:
        DatasetError: A file of the checkpoint is damaged.
    """
    config = _read(_TrainConfig, pretrained / "train_config.json")
    if config is None:
        return _read(TrainingFacts, pretrained / FACTS)
    folder = pretrained.absolute().parents[2]
    log = read_training_log(folder.with_name(f"{folder.name}.log"))
    step = _read(_Step, pretrained.parent / "training_state" / "training_step.json")
    demonstrations = _demonstrations(config.dataset)
    return TrainingFacts(
        name=folder.name,
        dataset=Path(config.dataset.root or config.dataset.repo_id).name,
        demonstrations=demonstrations,
        # As LeRobot rounds.
        held_out=math.ceil((demonstrations or 0) * config.dataset.eval_split),
        steps=step.step if step else None,
        batch_size=config.batch_size,
        seed=config.seed,
        minutes=log.minutes.get(step.step) if step else None,
        command=log.command,
        commit=log.commit,
    )


def _read[Model: BaseModel](model: type[Model], path: Path) -> Model | None:
    return validated_file(model, path) if path.is_file() else None


def _demonstrations(dataset: _Dataset) -> int | None:
    """Count the episodes of a training: those it names, or all of its dataset."""
    if dataset.episodes is not None:
        return len(dataset.episodes)
    info = _read(_DatasetInfo, Path(dataset.root or "") / "meta" / "info.json")
    return info.total_episodes if info else None
