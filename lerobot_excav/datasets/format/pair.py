"""The name of one scene shown with one target."""

from typing import NamedTuple

from lerobot_excav.errors import DatasetError


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
        parts = uid.split("/")
        if len(parts) == 4 and parts[2].isdecimal() and parts[3].isdecimal():
            return cls(parts[0], parts[1], int(parts[2]), int(parts[3]))
        raise DatasetError(
            f"excav.pair_uid={uid!r} is not of the form env/scene_set/scene_id/target_id; "
            "rebuild the column with `lerobot-excav index DATASET --session=FILE`"
        )
