"""How a checkpoint was trained, from the files that LeRobot keeps with it."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.experiment.stage_record import log_path, read_record
from lerobot_excav.evaluation.training_log import training_minutes

_POLICY_PATH = re.compile(r"--policy\.path[= ](\S+)")


@dataclass(frozen=True, kw_only=True)
class Training:
    """Facts of a training up to one checkpoint; None where no file tells.

    Attributes:
        name: Name of the training's folder.
        dataset: Name of the dataset's folder.
        demonstrations: Episodes given to the training, the held-out ones among them.
        held_out: Episodes of them that it did not learn from.
        steps: Steps up to the checkpoint.
        batch_size: Samples per step.
        seed: Seed of the training.
        minutes: Time up to the checkpoint [min].
        command: Command of the training.
        commit: Commit of the code.
    """

    name: str
    dataset: str
    demonstrations: int | None
    held_out: int
    steps: int | None
    batch_size: int
    seed: int | None
    minutes: float | None
    command: str | None
    commit: str | None

    @property
    def samples(self) -> int | None:
        """Samples seen up to the checkpoint."""
        return None if self.steps is None else self.steps * self.batch_size

    def as_dict(self) -> dict[str, Any]:
        """Return the fields by name."""
        return asdict(self)


def read_training(pretrained: Path) -> Training | None:
    """Read how a checkpoint was trained.

    Args:
        pretrained: Its folder `TRAINING/checkpoints/STEP/pretrained_model`.

    Returns:
        None if the folder is no checkpoint of `lerobot-train`, or is gone.
    """
    config_path = pretrained / "train_config.json"
    if not config_path.is_file():
        return None
    config = json.loads(config_path.read_text())
    folder = pretrained.absolute().parents[2]
    record = read_record(folder)
    steps = _steps(pretrained.parent)
    demonstrations = _demonstrations(config["dataset"])
    return Training(
        name=folder.name,
        dataset=Path(config["dataset"]["root"] or config["dataset"]["repo_id"]).name,
        demonstrations=demonstrations,
        # As LeRobot rounds.
        held_out=math.ceil((demonstrations or 0) * config["dataset"].get("eval_split", 0.0)),
        steps=steps,
        batch_size=config["batch_size"],
        seed=config["seed"],
        minutes=None if steps is None else training_minutes(log_path(folder)).get(steps),
        command=record.command if record else None,
        commit=record.commit if record else None,
    )


def evaluated_training(command: str) -> Training | None:
    """Read how the policy of an evaluation is trained by now; None if the command names no checkpoint that is there."""
    found = _POLICY_PATH.search(command)
    return read_training(Path(found[1])) if found else None


def training_from(content: Mapping[str, Any], path: Path) -> Training:
    """Make a training of its entries in a file.

    Raises:
        DatasetError: They are others.
    """
    unlike = sorted(set(content) ^ {entry.name for entry in fields(Training)})
    if unlike:
        raise DatasetError(
            f"{path}: its `training` has other entries than this version knows: {', '.join(unlike)}; "
            "remove `training` from the file, or make it again with this version"
        )
    return Training(**content)


def _steps(checkpoint: Path) -> int | None:
    path = checkpoint / "training_state" / "training_step.json"
    return int(json.loads(path.read_text())["step"]) if path.is_file() else None


def _demonstrations(dataset: dict[str, Any]) -> int | None:
    """Count the episodes of a training: those it names, or all of its dataset."""
    if dataset.get("episodes") is not None:
        return len(dataset["episodes"])
    path = Path(dataset["root"] or "") / "meta" / "info.json"
    return int(json.loads(path.read_text())["total_episodes"]) if path.is_file() else None
