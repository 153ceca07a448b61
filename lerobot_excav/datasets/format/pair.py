"""The name of one start shown with one target."""

import re
from typing import NamedTuple

from lerobot_excav.errors import DatasetError

_NUMBER = "(0|[1-9][0-9]{0,18})"
_UID = re.compile(f"([^/]+)/([^/]+)/{_NUMBER}/{_NUMBER}/{_NUMBER}")


class Pair(NamedTuple):
    """One start shown with one target; a start is a scene at a stage, the cycles that were dug before."""

    env: str
    scene_set: str
    scene_id: int
    stage: int  # 0 where a task has no stages
    target_id: int

    @property
    def uid(self) -> str:
        """The `pair_uid`: `env/scene_set/scene_id/stage/target_id`."""
        return f"{self.env}/{self.scene_set}/{self.scene_id}/{self.stage}/{self.target_id}"

    @property
    def reset_options(self) -> dict[str, int]:
        """Options of an environment's `reset` that begin with this start and target."""
        return {"scene_id": self.scene_id, "stage": self.stage, "target_id": self.target_id}

    @classmethod
    def parse(cls, uid: str) -> "Pair":
        """Read a `pair_uid`.

        Raises:
            DatasetError: It has another form.
        """
        if found := _UID.fullmatch(uid):
            return cls(found[1], found[2], int(found[3]), int(found[4]), int(found[5]))
        raise DatasetError(
            f"excav.pair_uid={uid!r:.100} is not of the form env/scene_set/scene_id/stage/target_id; "
            "rebuild the column with `lerobot-excav index DATASET --session=FILE`"
        )
