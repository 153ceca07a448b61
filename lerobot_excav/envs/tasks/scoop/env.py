"""The excavator as a gymnasium environment."""

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.control import checked_action
from lerobot_excav.envs.machines.excavator.features import CAMERAS, STATE_NAMES
from lerobot_excav.envs.machines.excavator.rendering import WorksiteRenderer
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.masks.mask_condition import conditioned_mask, corruption_rng
from lerobot_excav.envs.masks.mask_noise import noisy_mask
from lerobot_excav.envs.tasks.observation import OBS_TYPES, observation_space
from lerobot_excav.envs.tasks.scoop.cycle import DigCycle
from lerobot_excav.envs.tasks.scoop.scene import Scene, draw_scene
from lerobot_excav.envs.tasks.scoop.simulation_version import SIMULATION_VERSION
from lerobot_excav.envs.tasks.scoop.targets import Target, target_mask_img
from lerobot_excav.envs.tasks.selection import select_scene_and_target
from lerobot_excav.envs.tasks.settings import (
    EXCAVATOR_EPISODE_DURATION_S,
    EXCAVATOR_TASKS,
    FIDELITIES,
    RENDER_MODES,
    SOILS,
    TARGETS_PER_SCENE,
    TICKS_PER_SECOND,
    require_episode_length,
    require_mask_settings,
    require_task,
    require_view_settings,
)
from lerobot_excav.errors import ConfigurationError, require_choice

TASK_DESCRIPTION = "Dig where the mask points, carry the soil to the box and dump it there."

# Reward scale: a full bucket of sand [kg] (reference figure of the paper's operator; kind: paper).
FULL_BUCKET_KG = 485.0


class ExcavatorEnv(gym.Env[dict[str, Any], NDArray[Any]]):
    """An 8-t excavator in front of a pile, with a box to its left.

    Task (`Scoop-v0`): one dig-load-dump cycle on the region that the target mask shows.

    Scene and randomisation: pile shape and mass, colours, light, initial joint angles and the four targets come from
    `scene_set` and `scene_id`. `reset(seed=s)` selects `scene_id = s` and `target_id = s % 4`;
    `reset(options={"scene_id": …, "target_id": …})` selects directly, without a target `scene_id % 4`. A reset with
    neither draws a scene.

    Observation:

    | key | shape, type | meaning |
    |---|---|---|
    | `pixels/main` | (H, W, 3) uint8 | fixed, raised view of the dig area |
    | `pixels/cab` | (H, W, 3) uint8 | view along the boom, turns with the house |
    | `pixels/target_mask` | (H, W, 3) uint8, {0, 255} | commanded dig region in `main` at the start of the cycle |
    | `agent_pos[0:4]` | float32 | joint positions swing, boom, arm, bucket [rad] |
    | `agent_pos[4:8]` | float32 | joint velocities in the same order [rad/s] |

    Action: float32 (4,) in [-1, 1], rate commands for swing, boom, arm, bucket; values beyond are clipped.

    Reward: gain of soil in the box divided by 485 kg, plus 1 on success.

    Success: at loading onset the cutting edge was inside the patch, at least 100 kg lie in the box, the bucket has been
    empty for 0.5 s and nothing of the machine hit the box hard. `info["is_success"]` is true only then.

    Termination: the cycle is complete (bucket emptied into the box). Truncation: the time limit `episode_length`.

    Args:
        task: One of `envs.GYM_IDS`.
        obs_type: `pixels_agent_pos`, or `agent_pos` to leave the pictures out (several times faster).
        observation_height: Image height H [px].
        observation_width: Image width W [px].
        scene_set: `train`, `val` or `test`.
        mask_condition: Which mask is shown, see `mask_condition.py`.
        mask_noise: `none`, `shift`, `erode` or `dilate`, see `mask_noise.py`.
        mask_noise_px: Size of the noise [px].
        fps: Frames per second; divides 50.
        episode_length: Time limit in frames; None: those of 20 s.
        soil: Name of the soil preset.
        fidelity: Numerical effort of the soil: `fast`, `standard` or `fine`.
        render_mode: `rgb_array` or None.
        depth_info: Whether `info["depth_m"]` holds the result of `depth_m()`; never an observation of a policy.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012 - gymnasium's contract

    def __init__(
        self,
        *,
        task: str = "Scoop-v0",
        obs_type: str = "pixels_agent_pos",
        observation_height: int = 96,
        observation_width: int = 128,
        scene_set: str = "train",
        mask_condition: str = "correct",
        mask_noise: str = "none",
        mask_noise_px: int = 0,
        fps: int = 10,
        episode_length: int | None = None,
        soil: str = "sand",
        fidelity: str = "standard",
        render_mode: str | None = "rgb_array",
        depth_info: bool = False,
    ) -> None:
        require_task("task", task, EXCAVATOR_TASKS)
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
        require_choice("soil", soil, SOILS)
        require_choice("fidelity", fidelity, FIDELITIES)
        require_choice("render_mode", render_mode, RENDER_MODES)
        require_episode_length("episode_length", episode_length)
        self.task, self.task_description = task, TASK_DESCRIPTION
        self.scene_set, self.mask_condition = scene_set, mask_condition
        self.mask_noise, self.mask_noise_px = mask_noise, mask_noise_px
        self.soil_name, self.fidelity = soil, fidelity
        self.fps = fps
        self.episode_length = (
            round(EXCAVATOR_EPISODE_DURATION_S * fps) if episode_length is None else episode_length
        )
        self._max_episode_steps = self.episode_length  # the name by which LeRobot's evaluation asks for it
        self.obs_type, self.render_mode, self.depth_info = obs_type, render_mode, depth_info
        self.metadata = {**type(self).metadata, "render_fps": fps}
        self.observation_size = (observation_height, observation_width)
        self.observation_space = observation_space(
            obs_type, size=self.observation_size, cameras=CAMERAS, state_size=len(STATE_NAMES)
        )
        self.action_space = gym.spaces.Box(-1.0, 1.0, (4,), np.float32)
        self._ticks_per_frame = TICKS_PER_SECOND // fps
        self._worksite: Worksite | None = None
        self._renderer: WorksiteRenderer | None = None
        self._cycle: DigCycle | None = None
        self._frame = 0
        self._main_img: NDArray[np.uint8] | None = None
        self._main_img_time_s = 0.0

    @property
    def worksite(self) -> Worksite:
        """Machine, soil and box; built at first use, so that vector workers build their own."""
        if self._worksite is None:
            self._worksite = Worksite(soil=self.soil_name, fidelity=self.fidelity)
        return self._worksite

    @property
    def cycle(self) -> DigCycle:
        """The running cycle.

        Raises:
            ConfigurationError: The environment has not been reset.
        """
        if self._cycle is None:
            raise ConfigurationError("the environment has no episode yet; call reset() first")
        return self._cycle

    @property
    def scene(self) -> Scene:
        """The scene of the running episode."""
        return self.cycle.scene

    @property
    def target_id(self) -> int:
        """Index of the commanded target in `scene.targets`."""
        return self.cycle.target_id

    @property
    def target(self) -> Target:
        """The commanded dig region."""
        return self.cycle.target

    @property
    def renderer(self) -> WorksiteRenderer:
        """Camera pictures of the worksite; the graphics context is made at first use."""
        if self._renderer is None:
            height, width = self.observation_size
            self._renderer = WorksiteRenderer(self.worksite.machine, height=height, width=width)
        return self._renderer

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode; see the class for how seed and options select scene and target.

        Args:
            seed: Selects scene and target. A corrupted mask depends on these alone.
            options: May hold `scene_id` and `target_id`, and LeRobot's own keys, which begin with `lerobot_`.

        Returns:
            Observation and info.

        Raises:
            ConfigurationError: `scene_id` or `target_id` is no integer or out of range, or an option is unknown.
        """
        super().reset(seed=seed)
        scene_id, target_id = select_scene_and_target(
            seed, options or {}, rng=self.np_random, target_count=TARGETS_PER_SCENE
        )
        scene = draw_scene(self.scene_set, scene_id, soil=self.soil_name)
        self.worksite.reset(scene)
        self._cycle = DigCycle(self.worksite, scene, target_id)
        self._frame, self._main_img = 0, None
        if self.obs_type == "pixels_agent_pos":
            self._mask_img = self._draw_mask(scene, target_id)
        return self._observe(), self._info()

    def step(self, action: NDArray[Any]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance by one frame (1/fps s); see the class for action, reward and termination.

        Raises:
            ConfigurationError: The action has another shape than (4,) or is not finite.
        """
        command = checked_action(action)
        cycle = self.cycle
        deposited_before_kg = cycle.state.deposited_mass_kg
        for _ in range(self._ticks_per_frame):
            self.worksite.tick(command)
            cycle.update()
        self._frame += 1
        reward = (cycle.state.deposited_mass_kg - deposited_before_kg) / FULL_BUCKET_KG + float(
            cycle.is_success
        )
        terminated = cycle.is_complete
        truncated = self._frame >= self.episode_length and not terminated
        info = self._info()
        if terminated or truncated:
            info["episode_metrics"] = self._episode_metrics()
        return self._observe(), float(reward), terminated, truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return the main view (H, W, 3) uint8, or None without a render mode."""
        if self.render_mode is None:
            return None
        return self._draw_main()

    def depth_m(self) -> NDArray[np.float32]:
        """Return the depth image registered with `main` [m along the optical axis], shape (H, W), float32."""
        return self.renderer.depth("main", self.worksite.soil)

    def close(self) -> None:
        """Free the graphics context."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = self._main_img = None

    def _draw_mask(self, scene: Scene, target_id: int) -> NDArray[np.uint8]:
        points_w = self.renderer.terrain_points_w(self.worksite.soil)
        masks = [target_mask_img(target, points_w) for target in scene.targets]
        rng = corruption_rng(scene.scene_set, scene.scene_id, target_id)
        mask = conditioned_mask(masks, target_id, self.mask_condition, rng)
        return noisy_mask(mask, self.mask_noise, self.mask_noise_px, rng)

    def _draw_main(self) -> NDArray[np.uint8]:
        """Draw the main view, or repeat it if the worksite has not moved since: LeRobot's videos ask for it again."""
        if self._main_img is None or self._main_img_time_s != self.worksite.time_s:
            self._main_img = self.renderer.render("main", self.worksite.soil)
            self._main_img_time_s = self.worksite.time_s
        return self._main_img.copy()

    def _observe(self) -> dict[str, Any]:
        machine = self.worksite.machine
        observation: dict[str, Any] = {
            "agent_pos": np.concatenate([machine.joint_pos, machine.joint_vel]).astype(np.float32)
        }
        if self.obs_type == "pixels_agent_pos":
            soil = self.worksite.soil
            observation["pixels"] = {
                "main": self._draw_main(),
                "cab": self.renderer.render("cab", soil),
                "target_mask": self._mask_img.copy(),
            }
        return observation

    def _info(self) -> dict[str, Any]:
        info = {
            "is_success": self.cycle.is_success,
            "task_state": self.cycle.state.as_array(),
            "scene_id": self.scene.scene_id,
            "target_id": self.target_id,
        }
        return info | {"depth_m": self.depth_m()} if self.depth_info else info

    def _episode_metrics(self) -> dict[str, Any]:
        return {
            "simulation_version": SIMULATION_VERSION,
            "task": self.task,
            "scene_set": self.scene_set,
            "scene_id": self.scene.scene_id,
            "target_id": self.target_id,
            "mask_condition": self.mask_condition,
            "mask_noise": self.mask_noise,
            "mask_noise_px": self.mask_noise_px,
            "soil": self.soil_name,
            "fidelity": self.fidelity,
            "fps": self.fps,
            "episode_length": self.episode_length,
            "is_success": self.cycle.is_success,
            "frames": self._frame,
            **self.cycle.metrics(),
        }
