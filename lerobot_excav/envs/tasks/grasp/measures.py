"""What is measured of FR5Grasp-v0: success, and apart from it which block was grasped."""

from typing import TYPE_CHECKING, Any, override

from pydantic import Field

from lerobot_excav.envs.machines.fr5.layout import NO_BLOCK
from lerobot_excav.envs.tasks.grasp.spec import TASK_STATE_NAMES
from lerobot_excav.envs.tasks.measures import Column, EpisodeRecord, Kind, TaskMeasures
from lerobot_excav.envs.tasks.settings import TARGETS_PER_SCENE

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray

COMMANDED, OTHER, NONE = GRASPED = ("commanded", "other", "none")


class GraspRecord(EpisodeRecord):
    """Outcome of one grasping episode; where the command changed, the last one counts."""

    episode_return: float  # sum of the rewards
    # First block that the fingers lifted since the last command; -1 if they lifted none.
    first_grasped_block: int = Field(ge=NO_BLOCK, lt=TARGETS_PER_SCENE)
    target_in_tray: bool  # whether the commanded block rests in the tray
    blocks_in_tray: int = Field(ge=0, le=TARGETS_PER_SCENE)  # how many blocks do

    @property
    def grasped(self) -> str:
        """Which block was grasped first: `commanded`, `other` or `none`."""
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
        if not self.has_grasped or self.shown_target_id == NO_BLOCK:
            return None
        return self.first_grasped_block == self.shown_target_id

    @property
    def placed(self) -> bool | None:
        """Of episodes that grasped the commanded block first: whether they succeeded."""
        return self.is_success if self.grasped == COMMANDED else None

    @property
    @override
    def obeyed_shown_mask(self) -> bool:
        """Whether the block that was grasped first is the one that the mask showed, and not the commanded one."""
        return self.mask_followed is True and self.grasped == OTHER


def grasp_outcome(task_state: "NDArray[Any]") -> dict[str, Any]:
    """Return what was grasped and what lies in the tray, from the task states of an episode, (n, 8)."""
    last = dict(zip(TASK_STATE_NAMES, task_state[-1].tolist(), strict=True))
    return {
        "first_grasped_block": round(last["first_grasped_block"]),
        "target_in_tray": bool(last["target_in_tray"]),
        "blocks_in_tray": round(last["blocks_in_tray"]),
    }


def grasp_summary(index: "pd.DataFrame") -> str:
    """Describe the outcomes of an index."""
    took_target = int((index["first_grasped_block"] == index["final_target_id"]).sum())
    return f"first block taken: the commanded one in {took_target} of {len(index)}"


def _legend(operator: str | None) -> list[str]:
    lines = [
        "Success: at the end the commanded block, and no other, rests in the tray, released.",
        "Target selection: of the episodes that grasped any block, the share whose first was the commanded one.",
        "Mask followed: of the episodes that grasped a block while the mask showed one, the share that took that one.",
        "Placed: of the episodes that grasped the commanded block first, the share that succeeded.",
        f"First grasped: episodes by the first block that was lifted, {' / '.join(GRASPED)}.",
    ]
    return lines if operator is None else [*lines, f"Operator: {operator}."]


GRASP_MEASURES = TaskMeasures(
    record=GraspRecord,
    settings={},
    shared={"changes": "times at which the command changes"},
    setting={"mask": "mask"},
    columns=(
        Column(key="success", header="success [%]", kind=Kind.RATE, field="is_success"),
        Column(key="episode_return", header="return", kind=Kind.MEAN, field="episode_return"),
        Column(key="grasped", header="grasped any [%]", kind=Kind.RATE, field="has_grasped"),
        Column(key="target_selection", header="target selection [%]", kind=Kind.RATE, field="target_selected"),
        Column(key="mask_followed", header="mask followed [%]", kind=Kind.RATE, field="mask_followed"),
        Column(key="placed", header="placed [%]", kind=Kind.RATE, field="placed"),
        Column(key="first_grasped", header="first grasped", kind=Kind.COUNTS, field="grasped", words=GRASPED),
    ),
    compared=("success", "episode_return"),
    world="was played in version {simulation_version} of the simulation",
    simulation="version {simulation_version}",
    legend=_legend,
    outcome=grasp_outcome,
    summary=grasp_summary,
)
