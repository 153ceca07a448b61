"""The FR5 arm among four blocks as a gymnasium environment."""

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.fr5.features import CAMERAS, STATE_NAMES
from lerobot_excav.envs.machines.fr5.layout import BLOCK_COUNT, NO_BLOCK
from lerobot_excav.envs.machines.fr5.rendering import WorkcellRenderer
from lerobot_excav.envs.machines.fr5.workcell import ACTION_HIGH, ACTION_LOW, Workcell
from lerobot_excav.envs.masks.mask_condition import conditioned_mask, corruption_rng
from lerobot_excav.envs.masks.mask_noise import noisy_mask
from lerobot_excav.envs.tasks.grasp.scene import GraspScene, draw_scene
from lerobot_excav.envs.tasks.grasp.simulation_version import SIMULATION_VERSION
from lerobot_excav.envs.tasks.grasp.task import GraspTask
from lerobot_excav.envs.tasks.observation import OBS_TYPES, observation_space
from lerobot_excav.envs.tasks.selection import select_scene_and_target
from lerobot_excav.envs.tasks.settings import (
    FR5_EPISODE_DURATION_S,
    FR5_TASKS,
    RENDER_MODES,
    SCENE_SETS,
    TICKS_PER_SECOND,
    require_episode_length,
    require_mask_settings,
    require_retarget_frame,
    require_task,
    require_view_settings,
)
from lerobot_excav.errors import ConfigurationError, require_choice

TASK_DESCRIPTION = "Put the block that the mask marks into the tray."
_RETARGET_STREAM = 0x4E77  # names the random streams from which the second target is drawn


class FR5GraspEnv(gym.Env[dict[str, Any], NDArray[Any]]):
    """A Fairino FR5 arm with a two-finger gripper, four blocks and a tray.

    Task (`FR5Grasp-v0`): put the block that the target mask shows, and no other, into the tray.

    Scene and randomisation: places and colours of the blocks, table, light and initial joint angles come from
    `scene_set` and `scene_id`. `reset(seed=s)` selects `scene_id = s` and `target_id = s % 4`;
    `reset(options={"scene_id": …, "target_id": …})` selects directly, without a target `scene_id % 4`. A reset with
    neither draws a scene.

    Observation:

    | key | shape, type | meaning |
    |---|---|---|
    | `pixels/main` | (H, W, 3) uint8 | fixed view from beside the foot of the arm over blocks and tray |
    | `pixels/top` | (H, W, 3) uint8 | fixed view from above |
    | `pixels/target_mask` | (H, W, 3) uint8, {0, 255} | commanded block in `main` when it was commanded, arm hidden |
    | `agent_pos` | (7,) float32 | six joint positions [rad], opening of the gripper [0 closed .. 1 open] |

    Action: float32 (7,), six joint position targets [rad] and the gripper's target [0..1]; clipped to the limits.

    Reward: 0 to 4 per frame, see `GraspTask`.

    Success: at the last frame the commanded block, and no other, rests in the tray, released. `info["is_success"]` is
    true only then.

    Termination: never. Truncation: the time limit `episode_length`.

    Args:
        task: One of `settings.FR5_TASKS`.
        obs_type: `pixels_agent_pos`, or `agent_pos` to leave the pictures out (many times faster).
        observation_height: Image height H [px].
        observation_width: Image width W [px].
        scene_set: `train`, `val` or `test`.
        mask_condition: Which mask is shown, see `mask_condition.py`.
        mask_noise: `none`, `shift`, `erode` or `dilate`, see `mask_noise.py`.
        mask_noise_px: Size of the noise [px].
        retarget_frame: Frame before which another block is commanded; None: never.
        fps: Frames per second; divides 50.
        episode_length: Time limit in frames; None: those of 8 s.
        render_mode: `rgb_array` or None.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012 - gymnasium's contract

    def __init__(
        self,
        *,
        task: str = "FR5Grasp-v0",
        obs_type: str = "pixels_agent_pos",
        observation_height: int = 96,
        observation_width: int = 128,
        scene_set: str = "train",
        mask_condition: str = "correct",
        mask_noise: str = "none",
        mask_noise_px: int = 0,
        retarget_frame: int | None = None,
        fps: int = 50,
        episode_length: int | None = None,
        render_mode: str | None = "rgb_array",
    ) -> None:
        require_task("task", task, FR5_TASKS)
        require_choice("obs_type", obs_type, OBS_TYPES)
        require_view_settings(
            "",
            scene_set=scene_set,
            fps=fps,
            observation_height=observation_height,
            observation_width=observation_width,
        )
        require_mask_settings(
            "",
            mask_condition=mask_condition,
            mask_noise=mask_noise,
            mask_noise_px=mask_noise_px,
        )
        require_choice("render_mode", render_mode, RENDER_MODES)
        require_episode_length("episode_length", episode_length)
        self.fps = fps
        self.episode_length = (
            round(FR5_EPISODE_DURATION_S * fps) if episode_length is None else episode_length
        )
        require_retarget_frame("retarget_frame", retarget_frame, self.episode_length)
        self.task, self.task_description = task, TASK_DESCRIPTION
        self.scene_set, self.mask_condition = scene_set, mask_condition
        self.mask_noise, self.mask_noise_px, self.retarget_frame = mask_noise, mask_noise_px, retarget_frame
        self._max_episode_steps = self.episode_length  # the name by which LeRobot's evaluation asks for it
        self.obs_type, self.render_mode = obs_type, render_mode
        self.metadata = {**type(self).metadata, "render_fps": fps}
        self.observation_size = (observation_height, observation_width)
        self.observation_space = observation_space(
            obs_type, size=self.observation_size, cameras=CAMERAS, state_size=len(STATE_NAMES)
        )
        self.action_space = gym.spaces.Box(
            ACTION_LOW.astype(np.float32), ACTION_HIGH.astype(np.float32), dtype=np.float32
        )
        self._ticks_per_frame = TICKS_PER_SECOND // fps
        self._workcell: Workcell | None = None
        self._renderer: WorkcellRenderer | None = None
        self._grasp: GraspTask | None = None
        self._frame = 0
        self._main_img: NDArray[np.uint8] | None = None
        self._start_masks: NDArray[np.uint8] = np.zeros(
            (BLOCK_COUNT, observation_height, observation_width, 3), np.uint8
        )

    @property
    def workcell(self) -> Workcell:
        """Arm, blocks and tray; built at first use, so that vector workers build their own."""
        if self._workcell is None:
            self._workcell = Workcell()
        return self._workcell

    @property
    def grasp(self) -> GraspTask:
        """The task of the running episode.

        Raises:
            ConfigurationError: The environment has not been reset.
        """
        if self._grasp is None:
            raise ConfigurationError("the environment has no episode yet; call reset() first")
        return self._grasp

    @property
    def scene(self) -> GraspScene:
        """The scene of the running episode."""
        return self.grasp.scene

    @property
    def target_id(self) -> int:
        """Index of the block that is commanded now."""
        return self.grasp.target_id

    @property
    def renderer(self) -> WorkcellRenderer:
        """Camera pictures of the cell; the graphics context is made at first use."""
        if self._renderer is None:
            height, width = self.observation_size
            self._renderer = WorkcellRenderer(self.workcell, height=height, width=width)
        return self._renderer

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode; see the class for how seed and options select scene and target.

        Args:
            seed: Selects scene and target. A corrupted mask and a second target depend on these alone.
            options: May hold `scene_id` and `target_id`, and LeRobot's own keys, which begin with `lerobot_`.

        Returns:
            Observation and info.

        Raises:
            ConfigurationError: `scene_id` or `target_id` is no integer or out of range, or an option is unknown.
        """
        super().reset(seed=seed)
        scene_id, target_id = select_scene_and_target(
            seed, options or {}, rng=self.np_random, target_count=BLOCK_COUNT
        )
        scene = draw_scene(self.scene_set, scene_id)
        self.workcell.reset(scene)
        self._grasp = GraspTask(self.workcell, scene, target_id)
        self._frame, self._main_img = 0, None
        self._draw_mask()
        return self._observe(), self._info()

    def step(self, action: NDArray[Any]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance by one frame (1/fps s); see the class for action and reward.

        Raises:
            ConfigurationError: The action has another shape than (7,) or is not finite.
        """
        for _ in range(self._ticks_per_frame):
            self.workcell.tick(action)
        reward = self.grasp.update()
        self._frame += 1
        self._main_img = None
        if self._frame == self.retarget_frame:
            self.grasp.retarget(self._second_target())
            self._draw_mask()
        truncated = self._frame >= self.episode_length
        info = self._info()
        if truncated:
            info["is_success"] = self.grasp.is_success
            info["episode_metrics"] = self._episode_metrics()
        return self._observe(), reward, False, truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return the main view (H, W, 3) uint8, or None without a render mode."""
        return None if self.render_mode is None else self._draw_main()

    def close(self) -> None:
        """Free the graphics context."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = self._main_img = None

    def _second_target(self) -> int:
        key = (SCENE_SETS.index(self.scene_set), self.scene.scene_id, self.target_id)
        rng = np.random.default_rng(np.random.SeedSequence(_RETARGET_STREAM, spawn_key=key))
        return int(rng.choice([i for i in range(BLOCK_COUNT) if i != self.target_id]))

    def _draw_mask(self) -> None:
        self._shown_block: float = np.nan  # null in the file
        if self.obs_type != "pixels_agent_pos":
            return
        masks = self.renderer.block_masks()
        if self._frame > 0:
            # What another block or the tray's rim hides now is shown where it stood at the start.
            is_hidden = ~masks.any(axis=(1, 2, 3))
            masks[is_hidden] = self._start_masks[is_hidden]
        else:
            self._start_masks = masks
        rng = corruption_rng(self.scene_set, self.scene.scene_id, self.target_id)
        mask = conditioned_mask(list(masks), self.target_id, self.mask_condition, rng)
        self._shown_block = next((i for i in range(BLOCK_COUNT) if np.array_equal(mask, masks[i])), NO_BLOCK)
        self._mask_img = noisy_mask(mask, self.mask_noise, self.mask_noise_px, rng)

    def _draw_main(self) -> NDArray[np.uint8]:
        """Draw the main view, or repeat it if nothing has moved since: LeRobot's videos ask for it again."""
        if self._main_img is None:
            self._main_img = self.renderer.render("main")
        return self._main_img.copy()

    def _observe(self) -> dict[str, Any]:
        observation: dict[str, Any] = {"agent_pos": self.workcell.agent_pos}
        if self.obs_type == "pixels_agent_pos":
            observation["pixels"] = {
                "main": self._draw_main(),
                "top": self.renderer.render("top"),
                "target_mask": self._mask_img.copy(),
            }
        return observation

    def _info(self) -> dict[str, Any]:
        return {
            "is_success": False,
            "task_state": self.grasp.task_state,
            "scene_id": self.scene.scene_id,
            "target_id": self.target_id,
        }

    def _episode_metrics(self) -> dict[str, Any]:
        return {
            "simulation_version": SIMULATION_VERSION,
            "task": self.task,
            "mask_condition": self.mask_condition,
            "mask_noise": self.mask_noise,
            "mask_noise_px": self.mask_noise_px,
            # Not a number becomes null in the file.
            "retarget_frame": np.nan if self.retarget_frame is None else self.retarget_frame,
            "shown_block": self._shown_block,
            "fps": self.fps,
            "episode_length": self.episode_length,
            **self.grasp.episode_metrics,
        }
