"""How a dataset was made: `meta/excav_demonstrations.json`.

A sidecar that LeRobot's dataset tools drop, as they do with every file they do not know. Only continuing a finished run
needs it, and failed episodes are listed nowhere else.
"""

import json
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.episode_store import Outcome
from lerobot_excav.envs.configs.provenance import package_versions
from lerobot_excav.errors import DatasetError
from lerobot_excav.whole_file import write_whole

PROVENANCE_PATH = Path("meta/excav_demonstrations.json")

_OUTCOMES = TypeAdapter(list[Outcome])


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """Settings and outcomes of a scripted dataset.

    Attributes:
        settings: What was recorded.
        outcomes: Of every episode, kept or not: `pair_uid`, `seed`, `success`, `frames`, `kept`, `metrics`.
    """

    settings: DemonstrationSettings
    outcomes: list[Outcome]


def write_provenance(root: Path, settings: DemonstrationSettings, outcomes: list[Outcome]) -> None:
    """Write how a dataset was made."""
    record = {
        "packages": package_versions(),
        "operator": "scripted",
        "settings": settings.as_record(),
        "episodes": [
            {**outcome, "seed": settings.episode_seed(Pair.parse(outcome["pair_uid"]))} for outcome in outcomes
        ],
    }
    write_whole(root / PROVENANCE_PATH, json.dumps(record, indent=1) + "\n")


def read_provenance(root: Path) -> Provenance:
    """Read how a dataset was made.

    Raises:
        DatasetError: The dataset does not say.
        ConfigurationError: It was made in another version of the simulation.
    """
    path = root / PROVENANCE_PATH
    if not path.exists():
        raise DatasetError(
            f"{root} has no {PROVENANCE_PATH}: it was recorded, merged or edited, not made by `lerobot-excav demos`"
        )
    with reading(path):
        record = json.loads(path.read_text(encoding="utf-8"))
        settings, outcomes = dict(record["settings"]), _OUTCOMES.validate_python(record["episodes"])
    return Provenance(settings=DemonstrationSettings.from_record(settings, source=path), outcomes=outcomes)
