"""A command and its mask: what a machine is to act on, as a source of masks shows it in the main view."""

from abc import abstractmethod
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.machines.renderer import Renderer
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.geometry import GeometrySource
from lerobot_excav.envs.masks.overlap import MaskOverlap
from lerobot_excav.envs.masks.pointed import PointedSource
from lerobot_excav.envs.masks.shot import ENLARGED, Shot
from lerobot_excav.envs.masks.source import MaskMissingError, Pixels, TargetMask, chooses_target
from lerobot_excav.envs.tasks.retarget import second_target
from lerobot_excav.envs.tasks.selection import Selection
from lerobot_excav.envs.tasks.settings import SCENE_SETS
from lerobot_excav.envs.tasks.shown_source import ShownSource, shown_source
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.envs.tasks.watched import WatchedEnv
from lerobot_excav.errors import ConfigurationError, require, require_integer

MASK_MISSING_LIMIT_S = 10.0
"""How long a machine is held still while its mask source finds nothing [s]; then the episode is over (kind: guess)."""

Seen = tuple[dict[str, Any], dict[str, Any]]
"""Observation and info."""


class CommandedEnv(WatchedEnv):
    """An environment whose machine is to obey a command; a person may point elsewhere while it works."""

    task_spec: TaskSpec
    obs_type: str
    fps: int
    episode_length: int

    _selection: Selection | None
    _commands: list[Command]
    _mask: TargetMask | None
    _named_source: ShownSource  # the one that the settings name
    _source: ShownSource  # of the present command
    _frame: int
    _missing_frames: int
    _mask_fallbacks: int  # how often a source that chooses has left the choice to the planner
    _overlap: MaskOverlap  # of masks and targets
    _main_img: NDArray[np.uint8] | None
    _shot_renderer: Renderer | None = None

    # What a task says of itself.

    @property
    @abstractmethod
    def renderer(self) -> Renderer:
        """Camera pictures of the world."""

    @abstractmethod
    def open_renderer(self, height: int, width: int) -> Renderer:
        """Return a further renderer of the world, with pictures of another size [px]."""

    @abstractmethod
    def _advance(self, action: NDArray[Any]) -> tuple[float, bool]:
        """Pass a frame; return the reward, and whether the task is over.

        Raises:
            ConfigurationError: The action has another shape or is not finite.
        """

    @abstractmethod
    def _observe(self) -> dict[str, Any]:
        """Return the observation as it is now."""

    @abstractmethod
    def _info(self, *, is_over: bool) -> dict[str, Any]:
        """Return what is told beside the observation."""

    @abstractmethod
    def holding_action(self) -> NDArray[Any]:
        """Return the action that holds the machine still."""

    @abstractmethod
    def _region(self, target_id: int) -> Any:
        """Return the target of the scene with this index, as the task knows it."""

    @abstractmethod
    def true_mask(self, command: Command) -> Pixels:
        """Return which pixels of `main` show the target of a command once the machine is gone, (H, W) bool."""

    def _target_at(self, place_w: NDArray[np.float64]) -> int:
        """Return the target at a place (3,) [m], which may become a further one.

        Raises:
            ConfigurationError: There is none, and none can be made.
        """
        raise ConfigurationError(f"{self.task_spec.id} cannot be pointed at a place; command one of its targets")

    def _move_target(self, target_id: int, place_w: NDArray[np.float64]) -> None:
        """Move a target to a place (3,) [m], where a mask source has chosen to act.

        Raises:
            ConfigurationError: Targets cannot be moved.
        """
        raise ConfigurationError(f"mask_source={self.settings.mask_source!r} chooses where to act; here targets stay")

    def places_w(self) -> NDArray[np.float64]:
        """Return the points (H, W, 3) [m] that the pixels of `main` show, world frame; NaN where there is none."""
        return self.camera.points_w(self.depth_m())

    def _next_target(self) -> int | None:
        """Return the target that the task commands from this frame on; None leaves the command as it is."""
        if self._frame != getattr(self.settings, "retarget_frame", None):
            return None
        return second_target(self.scene_key, self.target_id, self._target_count)

    def _begin_command(self, target_id: int) -> None:
        """Take note that another target is commanded."""

    @property
    def _target_count(self) -> int:
        """How many targets can be commanded now."""
        return self.task_spec.target_count

    # What is commanded.

    @property
    def frame(self) -> int:
        """How many actions have been carried out in the running episode."""
        return self._frame

    @property
    def scene_id(self) -> int:
        """Scene of the running episode."""
        return self._require_episode().scene_id

    @property
    def stage(self) -> int:
        """Cycles that a seeded operator had dug before the start of the running episode."""
        return self._require_episode().stage

    @property
    def command(self) -> Command:
        """What is commanded now.

        Raises:
            ConfigurationError: The environment has not been reset.
        """
        self._require_episode()
        return self._commands[-1]

    @property
    def commands(self) -> tuple[Command, ...]:
        """All commands of the episode, the first at frame 0."""
        return tuple(self._commands)

    @property
    def target_id(self) -> int:
        """Index of the target that is commanded now."""
        return self.command.target_id

    # What a mask source may look at.

    @property
    def camera(self) -> PinholeCamera:
        """Where the main camera stands, and how it projects."""
        return self.renderer.camera("main")

    @property
    def scene_key(self) -> tuple[int, ...]:
        """Numbers of the scene set and of the scene, and of what a task tells apart within it."""
        return SCENE_SETS.index(self.settings.scene_set), self.scene_id, *((self.stage,) if self.stage else ())

    def picture(self) -> NDArray[np.uint8]:
        """Return the main picture, (H, W, 3) uint8; drawn once per frame, for mask sources ask for it again."""
        if self._main_img is None:
            self._main_img = self.renderer.render("main")
        return self._main_img.copy()

    def depth_m(self) -> NDArray[np.float32]:
        """Return the depth image registered with `main`, (H, W) float32 [m along the optical axis]."""
        return self.renderer.depth_m("main")

    def shot(self) -> Shot:
        """Return main and its depth, `ENLARGED` times sharper than policies see them."""
        if self._shot_renderer is None:
            height, width = self.settings.observation_size
            self._shot_renderer = self.open_renderer(ENLARGED * height, ENLARGED * width)
        eye = self._shot_renderer
        return Shot(picture=eye.render("main"), depth_m=eye.depth_m("main"), camera=eye.camera("main"))

    def command_key(self, command: Command) -> str:
        """Return `SCENE_SET/SCENE/STAGE/TARGET`, by which files of masks name a situation."""
        return f"{self.settings.scene_set}/{self.scene_id}/{self.stage}/{command.target_id}"

    def place_w(self, command: Command) -> NDArray[np.float64] | None:
        """Return where the target of a command is, (3,) [m], world frame; None if the task does not say it."""
        return None

    def patch(self, place_w: NDArray[np.float64], shot: Shot) -> Pixels | None:
        """Return the pixels of a shot that show the ground around a place; None where targets are objects."""
        return None

    def words(self, command: Command) -> str:
        """Return what people call the target of a command."""
        return self.task_spec.description

    def _close_shots(self) -> None:
        """Free the graphics context of the shots."""
        if self._shot_renderer is not None:
            self._shot_renderer.close()
            self._shot_renderer = None

    def other_commands(self) -> list[Command]:
        """Return what else could be commanded in this scene, in the order of the targets."""
        others = (i for i in range(self._target_count) if i != self.target_id)
        return [Command(target_id=i, region=self._region(i), since_frame=self._frame) for i in others]

    # The command and its mask.

    @property
    def mask(self) -> TargetMask | None:
        """The mask of the command, as shown now; None if nothing was found, or pictures are left out."""
        if self._mask is None:
            return None
        return self._source.at_frame(self._mask, self, self.command, self._frame)

    @property
    def mask_missing(self) -> bool:
        """Whether nothing was found for the command, so that no action is carried out."""
        return self._shows_pixels and self._mask is None

    def _give_command(self, target_id: int, source: ShownSource | None = None) -> None:
        """Command a target, shown by the source that the settings name unless by another."""
        command = Command(target_id=target_id, region=self._region(target_id), since_frame=self._frame)
        self._commands.append(command)
        self._source = source or self._named_source
        self._mask = None  # should the source fail, no other target is shown
        self._mask = self._ask(command) if self._shows_pixels else None

    def _ask(self, command: Command) -> TargetMask | None:
        """Ask the source for the mask of the newest command; where it chooses itself, the command's target moves."""
        mask = self._source.mask(self, command)
        if mask is None:
            return None
        if mask.place_w is not None:
            self._move_target(command.target_id, mask.place_w)
            self._commands[-1] = replace(command, region=self._region(command.target_id))
            self._mask_fallbacks += "fallback" in mask.parameters
            is_moved = self.settings.mask_condition == "random"
            mask = mask if is_moved else replace(mask, target_id=command.target_id)
        self._overlap.begin(self.true_mask(self._commands[-1]))
        return mask

    def _change_command(self) -> None:
        """Give the next command if it is time for one."""
        schedule = self._require_episode().schedule
        target_id = self._next_target() if schedule is None else dict(schedule).get(self._frame)
        if target_id is not None:
            self._begin_command(target_id)
            self._give_command(target_id)

    def _wait_for_mask(self) -> tuple[float, bool]:
        """Hold the machine still until there is a mask, within limits; return the reward, and whether it is over."""
        reward, terminated, left = 0.0, False, self.episode_length - self._frame - self._missing_frames
        patience = min(left, round(MASK_MISSING_LIMIT_S * self.fps))
        while self.mask_missing and not terminated and patience > 0:
            gain, terminated = self._advance(self.holding_action())
            reward, patience = reward + gain, patience - 1
            self._missing_frames += 1
            self._main_img = None
            self._mask = self._ask(self.command)
        return reward, terminated

    def observe(self) -> dict[str, Any]:
        """Return the observation as it is now.

        Raises:
            ConfigurationError: The environment has not been reset.
        """
        self._require_episode()
        return self._observe()

    # Pointing, while an episode runs.

    def recommand(self, target_id: int) -> Seen:
        """Command another target from the next action on; return observation and info as they are now.

        Raises:
            ConfigurationError: There is no such target now, or no episode runs.
            MaskMissingError: The mask source does not find it; the command stays as it was.
        """
        self._require_running()
        require_integer("target_id", target_id, 0, self._target_count - 1)
        return self._point(target_id, self._pointing_source)

    def point_at(self, x: float, y: float) -> Seen:
        """Command what the main picture shows at a place, from its upper left corner (0, 0) to its lower right (1, 1).

        Returns observation and info as they are now. On ground that is to be dug, the place becomes a further target of
        the scene.

        Raises:
            ConfigurationError: There is nothing to act on, or no episode runs.
            MaskMissingError: The mask source does not find it; the command stays as it was.
        """
        self._require_running()
        places_w = self.places_w()
        height, width = places_w.shape[:2]
        place_w = places_w[min(int(y * height), height - 1), min(int(x * width), width - 1)]
        require(
            bool(np.isfinite(place_w).all()), f"at x={x:.2f}, y={y:.2f} of the main picture there is nothing to act on"
        )
        return self._point(self._target_at(place_w), self._pointing_source)

    def point_with(self, pixels: Pixels) -> Seen:
        """Command what a mask (H, W) of the main picture covers, by that mask.

        Returns observation and info as they are now. The target, by which success is judged, is the one in its middle.

        Raises:
            ConfigurationError: The mask has another size, covers nothing to act on, or no episode runs.
        """
        self._require_running()
        size = self.settings.observation_size
        require(
            pixels.shape == size and pixels.dtype == np.bool_,
            f"a mask of shape {pixels.shape} and type {pixels.dtype} was given; give {size} of bool",
        )
        covered_w = self.places_w()[pixels]
        covered_w = covered_w[np.isfinite(covered_w).all(axis=-1)]
        require(len(covered_w) > 0, "the mask covers nothing to act on; mark soil, or a block")
        return self._point(
            self._target_at(covered_w.mean(axis=0)), shown_source(PointedSource(pixels), self.settings, may_snap=False)
        )

    def _point(self, target_id: int, source: ShownSource) -> Seen:
        """Command a target by a source's mask; without one, everything stays as it was."""
        commands, mask = list(self._commands), None
        self._commands.append(Command(target_id=target_id, region=self._region(target_id), since_frame=self._frame))
        try:
            mask = source.mask(self, self.command) if self._shows_pixels else None
            if self._shows_pixels and mask is None:
                raise MaskMissingError(f"mask_source={self.settings.mask_source!r} does not find target {target_id}")
        except BaseException:
            self._commands = commands
            raise
        if commands[-1].since_frame == self._frame:  # nothing was done under the command before
            del self._commands[-2]
        self._begin_command(target_id)
        self._source, self._mask = source, mask
        if mask is not None:
            self._overlap.begin(self.true_mask(self.command))
        return self._observe(), self._info(is_over=False)

    @property
    def _pointing_source(self) -> ShownSource:
        """What shows a target that a person commands: the source of the settings, unless that one chooses itself."""
        chooses = chooses_target(self.settings.mask_source)
        return shown_source(GeometrySource(), self.settings) if chooses else self._named_source

    def _require_running(self) -> None:
        self._require_episode()
        require(not self.is_over, "the episode is over; call reset() first")

    @property
    def _shows_pixels(self) -> bool:
        return self.obs_type == "pixels_agent_pos"

    def _require_episode(self) -> Selection:
        if self._selection is None:
            raise ConfigurationError("the environment has no episode yet; call reset() first")
        return self._selection
