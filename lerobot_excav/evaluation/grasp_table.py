"""FR5Grasp-v0 in reports: success, and apart from it which block was grasped."""

from dataclasses import dataclass
from typing import override

from lerobot_excav.envs.machines.fr5.layout import NO_BLOCK
from lerobot_excav.evaluation.episode import Episode
from lerobot_excav.evaluation.task_table import Column, Kind, TaskTable

COMMANDED, OTHER, NONE = GRASPED = ("commanded", "other", "none")


@dataclass(frozen=True, kw_only=True)
class GraspEpisode(Episode):
    """Outcome of one grasping episode.

    Attributes:
        final_target_id: Block that is commanded at the end; it differs from `target_id` where the command changed.
        retarget_frame: Frame at which the command changed; None if it did not.
        episode_return: Sum of the rewards.
        first_grasped_block: First block that the fingers lifted; -1 if they lifted none.
        shown_block: Block whose mask was shown, noise aside; -1 if the mask showed none, None if there was no mask.
        target_in_tray: Whether the commanded block rests in the tray.
        blocks_in_tray: How many blocks do.
    """

    final_target_id: int
    retarget_frame: int | None
    episode_return: float
    first_grasped_block: int
    shown_block: int | None
    target_in_tray: bool
    blocks_in_tray: int

    @property
    def grasped(self) -> str:
        """Which block was grasped first: `commanded` (at the end of the episode), `other` or `none`."""
        if self.first_grasped_block == NO_BLOCK:
            return NONE
        return COMMANDED if self.first_grasped_block == self.final_target_id else OTHER

    @property
    def has_grasped(self) -> bool:
        """Whether any block was grasped."""
        return self.grasped != NONE

    @property
    def target_selected(self) -> bool | None:
        """Of episodes that grasped a block: whether the first was the commanded one."""
        return self.grasped == COMMANDED if self.has_grasped else None

    @property
    def mask_followed(self) -> bool | None:
        """Of episodes that grasped a block and whose mask showed one: whether they are the same."""
        if not self.has_grasped or self.shown_block in (None, NO_BLOCK):
            return None
        return self.first_grasped_block == self.shown_block

    @property
    def placed(self) -> bool | None:
        """Of episodes that grasped the commanded block first: whether they succeeded."""
        return self.is_success if self.grasped == COMMANDED else None

    @property
    @override
    def mask(self) -> str:
        """What the mask showed, in words."""
        change = "" if self.retarget_frame is None else f", changed at frame {self.retarget_frame}"
        return super().mask + change


def _legend(operator: str | None) -> list[str]:
    lines = [
        "Success: at the end the commanded block, and no other, rests in the tray, released.",
        "Target selection: of the episodes that grasped any block, the share whose first was the commanded one.",
        "Mask followed: of the episodes that grasped a block while the mask showed one, the share that took that one.",
        "Placed: of the episodes that grasped the commanded block first, the share that succeeded.",
        f"First grasped: episodes by the first block that was lifted, {' / '.join(GRASPED)}.",
    ]
    return lines if operator is None else [*lines, f"Operator: {operator}."]


GRASP = TaskTable(
    task="FR5Grasp-v0",
    episode=GraspEpisode,
    constants={
        "mask_condition": "mask conditions",
        "mask_noise": "kinds of mask noise",
        "mask_noise_px": "strengths of mask noise",
        "retarget_frame": "times of the change of target",
        "simulation_version": "versions of the simulation",
    },
    setting={"mask": "mask"},
    columns=(
        Column(key="success", header="success [%]", kind=Kind.RATE, field="is_success"),
        Column(key="episode_return", header="return", kind=Kind.MEAN, field="episode_return"),
        Column(key="grasped", header="grasped any [%]", kind=Kind.RATE, field="has_grasped"),
        Column(
            key="target_selection", header="target selection [%]", kind=Kind.RATE, field="target_selected"
        ),
        Column(key="mask_followed", header="mask followed [%]", kind=Kind.RATE, field="mask_followed"),
        Column(key="placed", header="placed [%]", kind=Kind.RATE, field="placed"),
        Column(key="first_grasped", header="first grasped", kind=Kind.COUNTS, field="grasped", words=GRASPED),
    ),
    compared=("success", "episode_return"),
    world="was played in version {simulation_version} of the simulation",
    simulation="version {simulation_version}",
    legend=_legend,
)
