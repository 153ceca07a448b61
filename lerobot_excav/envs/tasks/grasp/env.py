"""The FR5 arm among four blocks as a gymnasium environment."""

from typing import Any, override

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5.rendering import WorkcellRenderer
from lerobot_excav.envs.machines.fr5.viewing import WorkcellView
from lerobot_excav.envs.machines.fr5.workcell import Workcell
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.source import Pixels
from lerobot_excav.envs.tasks.grasp.scene import GraspScene, draw_scene
from lerobot_excav.envs.tasks.grasp.task import GraspTask
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.selection import Selection
from lerobot_excav.errors import require

BLOCK_REACH_M = 0.05
"""From the middle of a block; what is farther away is no part of it [m] (derived: its half diagonal)."""


class FR5GraspEnv(MaskedTaskEnv[Workcell, WorkcellRenderer]):
    """A Fairino FR5 arm with a two-finger gripper, four blocks and a tray.

    Task (`FR5Grasp-v0`): put the block that the target mask shows, and no other, into the tray.

    Scene and randomisation: places and colours of the blocks, table, light and initial joint angles come from
    `scene_set` and the scene's number. With `retarget_frame` another block is commanded before that frame.

    Observation:

    | key | shape, type | meaning |
    |---|---|---|
    | `pixels/main` | (H, W, 3) uint8 | fixed view from beside the foot of the arm over blocks and tray |
    | `pixels/top` | (H, W, 3) uint8 | fixed view from above |
    | `pixels/target_mask` | (H, W, 3) uint8, {0, 255} | commanded block in `main` when it was commanded, arm hidden |
    | `agent_pos` | (7,) float32 | six joint positions [rad], opening of the gripper [0 closed .. 1 open] |
    | `environment_state` | (15,) float32 | with `obs_type="state"`, in place of pictures: middles of the blocks [m] |

    Action: float32 (7,), six joint position targets [rad] and the gripper's target [0..1]; clipped to the limits.

    Reward: 0 to 4 per frame, see `GraspTask`.

    Success: at the last frame the commanded block, and no other, rests in the tray, released. `info["is_success"]` is
    true only then.

    Termination: never. Truncation: the time limit `episode_length`.

    Arguments: those of `MaskedTaskEnv` and, as settings, the fields of `FR5Settings`.
    """

    TASK = "FR5Grasp-v0"

    _grasp: GraspTask

    @property
    def workcell(self) -> Workcell:
        """Arm, blocks and tray."""
        return self.world

    @property
    def grasp(self) -> GraspTask:
        """The task of the running episode.

        Raises:
            ConfigurationError: The environment has not been reset.
        """
        self._require_episode()
        return self._grasp

    @property
    def scene(self) -> GraspScene:
        """The scene of the running episode."""
        self._require_episode()
        return self._scene

    def _make_world(self) -> Workcell:
        return Workcell()

    def _make_renderer(self, world: Workcell, height: int, width: int) -> WorkcellRenderer:
        return WorkcellRenderer(world, height=height, width=width)

    def _make_view(self, height: int, width: int) -> WorkcellView:
        return WorkcellView(self.workcell, height=height, width=width)

    def _measured(self) -> tuple[str, ...]:
        return f"block {self.grasp.stage}", f"return {self.grasp.episode_return:.0f}"

    def _failure(self) -> str | None:
        if not self.is_over or self.is_success:
            return None
        return "wrong block" if self.grasp.has_wrong_block else "not in the tray"

    def _start(self, selection: Selection) -> None:
        scene = draw_scene(self.settings.scene_set, selection.scene_id)
        self.workcell.reset(scene)
        self._scene, self._grasp = scene, GraspTask(self.workcell, selection.target_id)
        self._start_pixels: NDArray[np.bool_] | None = None

    def _advance(self, action: NDArray[Any]) -> tuple[float, bool]:
        for _ in range(self._ticks_per_frame):
            self.workcell.tick(action)
        return self.grasp.update(), False

    def holding_action(self) -> NDArray[np.float64]:
        """Return the action that holds the machine still."""
        # Not `agent_pos`: fingers told to stay where a block stops them would no longer press on it.
        return self.workcell.reference

    def _region(self, target_id: int) -> int:
        return target_id  # a block is what its index says

    def _begin_command(self, target_id: int) -> None:
        self.grasp.retarget(target_id)

    @override
    def _target_at(self, place_w: NDArray[np.float64]) -> int:
        """Return the block at a place."""
        away_m = np.linalg.norm(self.workcell.block_pos_w - place_w, axis=1)
        require(float(away_m.min()) <= BLOCK_REACH_M, "there is no block at this place; point at one of the four")
        return int(away_m.argmin())

    @override
    def place_w(self, command: Command) -> NDArray[np.float64]:
        """Return the middle of the commanded block, (3,) [m]."""
        return np.asarray(self.workcell.block_pos_w[command.region])

    @override
    def words(self, command: Command) -> str:
        """Return what people call the commanded block."""
        return f"the {self._scene.colour_name(command.region)} block"

    def true_mask(self, command: Command) -> Pixels:
        """Return the pixels that show the block, (H, W) bool.

        What another block or the tray's rim hides now is shown where it stood at the start.
        """
        seen = self.renderer.block_pixels()
        if self._start_pixels is None:
            self._start_pixels = seen
        pixels = seen[command.region]
        return np.asarray(pixels if pixels.any() else self._start_pixels[command.region])

    @property
    def agent_pos(self) -> NDArray[np.float32]:
        """Joint positions [rad] and opening of the gripper, (7,) float32."""
        return self.workcell.agent_pos

    @property
    def task_state(self) -> NDArray[np.float32]:
        """State of the task, (8,) float32; see `spec.TASK_STATE_NAMES`."""
        return self.grasp.task_state

    @property
    def environment_state(self) -> NDArray[np.float32]:
        """Middle of the commanded block, then of every block, (15,) float32 [m]; see `spec.ENVIRONMENT_STATE_NAMES`."""
        block_pos_w = self.workcell.block_pos_w
        return np.asarray(np.concatenate([block_pos_w[self.target_id], block_pos_w.ravel()]), np.float32)

    @property
    def is_success(self) -> bool:
        """Whether the commanded block, and no other, rests in the tray."""
        return self.grasp.is_success

    def _measures(self) -> dict[str, Any]:
        return self.grasp.metrics()
