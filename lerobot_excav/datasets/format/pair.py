"""The name of one scene shown with one target."""

import re
from typing import NamedTuple

from lerobot_excav.errors import DatasetError

_NUMBER = "(0|[1-9][0-9]{0,18})"
_UID = re.compile(f"([^/]+)/([^/]+)/{_NUMBER}/{_NUMBER}")


class Pair(NamedTuple):
    """One scene shown with one target."""

    env: str
    scene_set: str
    scene_id: int
    target_id: int

    @property
    def uid(self) -> str:
        """The `pair_uid`: `env/scene_set/scene_id/target_id`."""
        return f"{self.env}/{self.scene_set}/{self.scene_id}/{self.target_id}"

    @classmethod
    def parse(cls, uid: str) -> "Pair":
        """Read a `pair_uid`.

        Raises:
            DatasetError: It has another form.
        """
        if found := _UID.fullmatch(uid):
            return cls(found[1], found[2], int(found[3]), int(found[4]))
        raise DatasetError(
            f"excav.pair_uid={uid!r:.100} is not of the form env/scene_set/scene_id/target_id; "
            "rebuild the column with `lerobot-excav index DATASET --session=FILE`"
        )
