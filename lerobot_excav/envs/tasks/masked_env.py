"""The environment of every task: a command, shown as a mask of the main view, and a machine that is to obey it."""

from abc import abstractmethod
from pathlib import Path
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.constants import TICKS_PER_SECOND
from lerobot_excav.envs.machines.renderer import Renderer
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.options import options_words
from lerobot_excav.envs.masks.overlap import MaskOverlap
from lerobot_excav.envs.masks.overlay import tinted
from lerobot_excav.envs.masks.source import TargetMask, make_mask_source
from lerobot_excav.envs.tasks.commanded import CommandedEnv
from lerobot_excav.envs.tasks.held_pictures import HeldPictures
from lerobot_excav.envs.tasks.registry import task_played_by
from lerobot_excav.envs.tasks.selection import Selection, select_episode
from lerobot_excav.envs.tasks.settings import RenderSettings
from lerobot_excav.envs.tasks.shown_source import shown_source
from lerobot_excav.errors import require, require_choice, require_integer
from lerobot_excav.setting import declared_settings

RENDER_MODES = ("rgb_array", None)

MOST_HELD_FRAMES = 1000
"""Frames for which the same pictures can be shown at most."""

NO_TARGET = -1
"""What stands for none of the targets where an index is expected."""


class MaskedTaskEnv[World, Picture: Renderer](CommandedEnv, gym.Env[dict[str, Any], NDArray[Any]]):
    """A machine in a scene, and a target that a mask of the main view commands.

    A task is a subclass that says how a scene begins, how a frame passes, what the targets are and what is measured.
    The rest is here: settings, spaces, seeds, pictures, the command and its mask, the metrics.

    `reset(seed=s)` selects `scene_id = s` and `target_id = s % 4`; `reset(options={"scene_id": …, "target_id": …,
    "stage": …, "commands": [(frame, target), …]})` selects directly; without a target it is `scene_id % 4` or the one
    the task names, and without `commands` the task decides whether it changes. A reset with nothing draws a scene.

    Where the mask source finds nothing, the machine is held still until it does: `reset` and `step` pass as many frames
    as that takes, and `mask_missing_frames` counts them. After `MASK_MISSING_LIMIT_S` the episode is given up:
    `info["mask_missing"]` is true, no action is carried out any more, and the next `step` ends it.

    Args:
        task: Id of the task; that of the class by default.
        obs_type: One of `task.OBS_TYPES`.
        render_mode: `rgb_array` or None.
        depth_info: Whether `info["depth_m"]` holds the result of `depth_m()`; never an observation of a policy.
        camera_every: Draw what policies see every n-th frame only, see `HeldPictures`.
        settings: Fields of the task's `TaskSettings` and of `RenderSettings`, by name.

    Raises:
        ConfigurationError: A setting is unknown or has a value that is not possible.
    """

    TASK: ClassVar[str]

    metadata = {"render_modes": ["rgb_array"], "render_fps": TICKS_PER_SECOND}  # noqa: RUF012 - gymnasium's contract

    def __init__(
        self,
        *,
        task: str | None = None,
        obs_type: str = "pixels_agent_pos",
        render_mode: str | None = "rgb_array",
        depth_info: bool = False,
        camera_every: int = 1,
        **settings: Any,
    ) -> None:
        self.task_spec = spec = task_played_by(type(self), self.TASK, task)
        shown = {name: settings.pop(name) for name in declared_settings(RenderSettings) if name in settings}
        self.settings, self.render_settings = spec.make_settings(**settings), RenderSettings(**shown)
        require_choice("obs_type", obs_type, spec.obs_types)
        self.settings.require_mask_effect(obs_type)
        require_choice("render_mode", render_mode, RENDER_MODES)
        require_choice("render_camera", self.render_settings.render_camera, spec.views)
        self.task, self.task_description = spec.id, spec.description
        self.obs_type, self.render_mode, self.depth_info = obs_type, render_mode, depth_info
        self.fps = self.settings.fps
        self.episode_length = self.settings.episode_length or spec.length_at(self.fps)
        self._max_episode_steps = self.episode_length  # the name by which LeRobot's evaluation asks for it
        self.metadata = {**type(self).metadata, "render_fps": self.fps}
        self.observation_space = spec.observation_space(obs_type, self.settings.observation_size)
        self.action_space = gym.spaces.Box(
            np.array(spec.action_low, np.float32), np.array(spec.action_high, np.float32), dtype=np.float32
        )
        require_integer("camera_every", camera_every, 1, MOST_HELD_FRAMES)
        require(
            camera_every == 1 or (self._shows_pixels and not depth_info),
            f"camera_every={camera_every} has no meaning with obs_type={obs_type!r} and depth_info={depth_info}: it "
            "holds pictures, and depth is of every frame; leave it out",
        )
        self._held = HeldPictures(camera_every)
        self._ticks_per_frame = TICKS_PER_SECOND // self.fps
        self._source = self._named_source = shown_source(
            make_mask_source(self.settings.mask_source, options=self.settings.mask_options), self.settings
        )
        options = self.settings.mask_options
        self._options_words = None if options is None else options_words(Path(options))
        self._world: World | None = None
        self._renderer: Picture | None = None
        self._selection: Selection | None = None
        self._commands: list[Command] = []
        self._mask: TargetMask | None = None
        self._overlap = MaskOverlap()
        self._frame = self._missing_frames = self._mask_fallbacks = 0
        self._main_img: NDArray[np.uint8] | None = None

    # What a task says of itself.

    @abstractmethod
    def _make_world(self) -> World:
        """Make the machine and its surroundings."""

    @abstractmethod
    def _make_renderer(self, world: World, height: int, width: int) -> Picture:
        """Make the renderer of the world."""

    @abstractmethod
    def _start(self, selection: Selection) -> None:
        """Reset the world to a scene, and begin the task on one of its targets; until then there is no episode."""

    @property
    @abstractmethod
    def agent_pos(self) -> NDArray[np.float32]:
        """What the policy feels of the machine, (states,) float32."""

    @property
    @abstractmethod
    def task_state(self) -> NDArray[np.float32]:
        """How far the task is, (k,) float32; never an input of a policy."""

    @property
    def environment_state(self) -> NDArray[np.float32]:
        """What pictures would show, as numbers, (n,) float32; a task whose spec names its elements has it."""
        raise NotImplementedError(f"{self.task} names environment_state_names and does not say what they are")

    @property
    @abstractmethod
    def is_success(self) -> bool:
        """Whether the task has succeeded by now; counts only when the decision is final."""

    @abstractmethod
    def _measures(self) -> dict[str, Any]:
        """Return the outcome part by part, as it goes into the metrics file."""

    # What every task shares.

    @property
    def world(self) -> World:
        """The machine and its surroundings; built at first use, so that vector workers build their own."""
        if self._world is None:
            self._world = self._make_world()
        return self._world

    @property
    def renderer(self) -> Picture:
        """Camera pictures of the world; the graphics context is made at first use."""
        if self._renderer is None:
            self._renderer = self._make_renderer(self.world, *self.settings.observation_size)
        return self._renderer

    def open_renderer(self, height: int, width: int) -> Picture:
        """Return a further renderer of the world, with pictures of another size [px]; whoever asks for it closes it."""
        return self._make_renderer(self.world, height, width)

    @property
    def time_s(self) -> float:
        """Simulated time since the start of the episode [s]."""
        return (self._frame + self._missing_frames) / self.fps

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode, and return observation and info; see the class for how seed and options select it.

        A corrupted mask and a second target depend on scene and target alone. LeRobot's own options (`lerobot_…`) are
        let pass.

        Raises:
            ConfigurationError: An option is unknown or has a value that is not possible.
        """
        super().reset(seed=seed)
        self._selection = self._picture = None  # until the start has succeeded
        rng, length = self.np_random, self.episode_length
        selection = select_episode(seed, options or {}, rng=rng, task=self.task_spec, length=length)
        self._start(selection)
        self._selection = selection
        self._frame = self._missing_frames = self._mask_fallbacks = 0
        self._commands, self._main_img, self._is_over = [], None, False
        self._held.forget()
        self._overlap.forget()
        try:
            self._give_command(selection.target_id)
            self._wait_for_mask()
        except BaseException:
            self._selection = None
            raise
        self._begin_film(f"{self.task}_{self.settings.scene_set}_{self.scene_id}_{self.stage}_{self.target_id}")
        return self._observe(), self._info(is_over=False)

    def step(self, action: NDArray[Any]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance by one frame (1/fps s); see the class of the task for action, reward and termination.

        Raises:
            ConfigurationError: The action has another shape than that of `action_space`, or is not finite.
        """
        self._require_episode()
        reward, terminated = 0.0, False
        if not self.mask_missing:
            reward, terminated = self._advance(action)
            self._frame += 1
            self._main_img = None
            if not terminated and self._frame + self._missing_frames < self.episode_length:
                self._change_command()
                held_reward, terminated = self._wait_for_mask()
                reward += held_reward
        frames = self._frame + self._missing_frames
        truncated = (self.mask_missing or frames >= self.episode_length) and not terminated
        self._is_over = terminated or truncated
        self._add_to_film()
        return self._observe(), float(reward), terminated, truncated, self._info(is_over=self._is_over)

    def close(self) -> None:
        """Free the graphics contexts."""
        self._close_views()
        self._close_shots()
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = self._main_img = None

    # What is shown and told.

    def _observe(self) -> dict[str, Any]:
        state = {"environment_state": self.environment_state} if self.obs_type == "state" else {}
        if not self._shows_pixels:
            return {"agent_pos": self.agent_pos, **state}
        shown = self.mask
        mask = None if shown is None else shown.pixels
        if mask is not None:
            self._overlap.add(mask, self._frame)
        pixels = self._held.shown(self._frame, mask, self._draw_all)
        return {"agent_pos": self.agent_pos, **state, "pixels": pixels}

    def _draw_all(self) -> dict[str, NDArray[np.uint8]]:
        return {camera: self._draw(camera) for camera in self.task_spec.cameras}

    def _draw(self, camera: str) -> NDArray[np.uint8]:
        if camera == "target_mask":
            empty, mask = np.zeros((*self.settings.observation_size, 3), np.uint8), self.mask
            return empty if mask is None else mask.img
        if camera != "main":
            return self.renderer.render(camera)
        picture = self.picture()
        mask = self.mask if self.settings.target_overlay else None
        return picture if mask is None else tinted(picture, mask.pixels)

    def _info(self, *, is_over: bool) -> dict[str, Any]:
        info = {
            "is_success": is_over and self.is_success,
            "task_state": self.task_state,
            "scene_id": self.scene_id,
            "stage": self.stage,
            "target_id": self.target_id,
            "command_frame": self.command.since_frame,
            "mask_missing": self.mask_missing,
            "mask_missing_frames": self._missing_frames,
        }
        info |= {"depth_m": self.depth_m()} if self.depth_info else {}
        return info | ({"episode_metrics": self._episode_metrics()} if is_over else {})

    def _episode_metrics(self) -> dict[str, Any]:
        shown = self._mask.target_id if self._mask is not None else None
        return {
            "simulation_version": self.task_spec.simulation_version,
            **{name: value for name, value in self.settings.as_dict().items() if value is not None},
            **({} if self._options_words is None else {"mask_options": self._options_words}),
            "episode_length": self.episode_length,
            "camera_every": self._held.every,
            "scene_id": self.scene_id,
            "stage": self.stage,
            "target_id": self._commands[0].target_id,
            "commands": [[command.since_frame, command.target_id] for command in self._commands],
            "shown_target_id": NO_TARGET if shown is None else shown,
            "mask_missing": self.mask_missing,
            "mask_missing_frames": self._missing_frames,
            "mask_fallbacks": self._mask_fallbacks,
            "mask_iou": self._overlap.mean,
            "is_success": self.is_success,
            "frames": self._frame,
            **self._measures(),
        }
