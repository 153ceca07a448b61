"""Where an evaluation comes from: its command, its code, and the training of its policy.

`X.json` beside `X.jsonl` says so, written by `envs.configs.provenance`. Copies on a result page hold the training as
well. Otherwise it is read where the command found the policy.
"""

from pathlib import Path
from typing import Self

from pydantic import BaseModel, ConfigDict

from lerobot_excav.datasets.format.validated import validated_file
from lerobot_excav.evaluation.training import TrainingFacts, read_training


class EvaluationOrigin(BaseModel):
    """Command and code of an evaluation, and the training of its policy; None where nothing tells."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    command: str | None  # for a shell
    commit: str | None = None
    modified: bool = False  # the package differed from that commit
    packages: dict[str, str] = {}  # versions by distribution
    started: str | None = None  # UTC
    seconds: float | None = None  # how long the command ran
    policy: str | None = None  # folder of the checkpoint that played
    training: TrainingFacts | None = None

    @classmethod
    def read(cls, metrics: Path) -> Self:
        """Read where the evaluation of a metrics file comes from.

        Raises:
            DatasetError: What lies in the place of the record is not one.
        """
        path = metrics.with_suffix(".json")
        if not path.is_file():
            return cls(command=None)
        origin = validated_file(cls, path)
        if origin.training is None and origin.policy is not None:
            return origin.model_copy(update={"training": read_training(Path(origin.policy))})
        return origin
