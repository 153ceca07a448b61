"""Where an evaluation comes from: its command and code, and the training of its policy.

The record of its stage lies beside the metrics file, or beside their folder, as a JSON file of the same name. Copies of
metrics files keep theirs. The training is that of the record; records of earlier versions have none, and the training
is looked up where their command found the policy.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lerobot_excav.evaluation.experiment.stage_record import StageRecord, read_json, record_from, record_path
from lerobot_excav.evaluation.training import Training, evaluated_training, training_from


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """Command and code of an evaluation, and the training of its policy.

    Attributes:
        record: What was run; None if the evaluation was run by hand.
        training: How the policy was trained; None if its checkpoint is unknown or gone.
    """

    record: StageRecord | None = None
    training: Training | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the record's entries, with those of the training in `training`."""
        record = asdict(self.record) if self.record else {}
        return {**record, "training": self.training.as_dict() if self.training else None}


def read_provenance(metrics: Path) -> Provenance:
    """Read where an evaluation comes from.

    Args:
        metrics: Its metrics file.

    Raises:
        DatasetError: What lies in the place of the record is none, or its training is not one.
    """
    path = record_path(metrics.parent) if metrics.stem == "metrics" else metrics.with_suffix(".json")
    if not path.is_file():
        return Provenance()
    content = read_json(path)
    training = content.pop("training", None)
    record = record_from(content, path) if content else None
    if training is not None:
        return Provenance(record=record, training=training_from(training, path))
    return Provenance(record=record, training=evaluated_training(record.command) if record else None)
