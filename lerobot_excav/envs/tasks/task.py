"""A task as data: everything that the rest of the package has to know of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Literal, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.acted_place import PlaceProbe
from lerobot_excav.envs.tasks.settings import TARGETS_PER_SCENE, TaskSettings
from lerobot_excav.envs.tasks.sticks import StickControl

if TYPE_CHECKING:
    from lerobot_excav.envs.tasks.measures import TaskMeasures


OBS_TYPES = ("pixels_agent_pos", "agent_pos", "state")
"""With pictures, and without: then no graphics context is made, and a step takes a fraction of the time. `state` adds
what the pictures would show, as numbers: for reinforcement learning."""


class Operator(Protocol):
    """A scripted operator of a task; with `cuts_rest` it also has `done`: whether the work is over and it rests."""

    @property
    def approach_s(self) -> float:
        """How long it is on its way after the newest command, before it touches what it is to act on [s]."""

    def reset(self, env: Any) -> None:
        """Look at a freshly reset environment of the task."""

    def act(self, env: Any) -> NDArray[np.float32]:
        """Return the next action, (actions,); after the end of the work one that holds still."""


@dataclass(frozen=True, kw_only=True)
class TaskSpec:
    """One task: names, limits and units as data, and where its code is.

    The code is named as `module:object` and loaded at first use, so that every command can list the tasks quickly.

    Attributes:
        id: Name in the gym namespace `lerobot_excav`.
        robot_type: `--robot.type` of its simulated robot, and `robot_type` of its datasets.
        description: What is to be done, in a sentence; the task of LeRobot's datasets.
        cameras: Names of the pictures: `main`, which the mask belongs to, others, and `target_mask`.
        views: Names of the cameras that people may look through, `overview` among them.
        state_names: Elements of `agent_pos` and `observation.state`; each ends in `.pos` or `.vel`.
        action_names: Elements of an action.
        action_low: Least value of each.
        action_high: Greatest value of each.
        task_state_names: Elements of `info["task_state"]`.
        environment_state_names: Elements of `environment_state`, the observation of `obs_type="state"` beside the
            joints; empty if the task has no such observation.
        duration_s: Time limit unless another is asked for [s].
        storage: How pictures of demonstrations are stored unless asked otherwise; long action chunks need `video`.
        settings: What a user may set; its `ENV_TYPE` is the `--env.type`.
        simulation_version: Version of the simulation. Recorded actions lead to the recorded states again in the version
            that made them only. It counts changes of soil, machine, scenes or targets after which a replay deviates or
            a scene's number means another scene, and changes of operator or planner where starts have stages; speed,
            pictures and policies are not part of it.
        changes: What each version is, or changed.
        env_entry: Class of the environment, a `MaskedTaskEnv`.
        operator_entry: Class of the scripted operator, an `Operator` made with `rng`.
        measures_entry: The `TaskMeasures`.
        nearest_target_entry: Function from settings, scene and stage to the target that is nearest at the start, as
            the task understands it; None if the task defines no such thing.
        sticks_entry: Class that says what two sticks mean to the machine, a `StickControl`; None if it cannot be driven
            by them.
        place_probe_entry: Class that tells where the machine acts, a `PlaceProbe`; None if the task cannot be audited.
        task_state_tolerance: Deviation of a task state that a replay may have, in the state's own unit.
        judges_at_the_end: Whether success is judged at the time limit only, so that a replay must end there.
        target_count: Targets of a scene.
        default_target: Target that is commanded first unless options of `reset` say otherwise; None if a scene is shown
            with all of them in turn.
        last_stage: How many cycles a seeded operator may have dug before the start; 0 if scenes have no stages.
        cuts_rest: Whether demonstrations end with the operator's last action: frames in which it rests until the
            environment says that the task is over are left out, and a replay holds the machine still for as long.
    """

    id: str
    robot_type: str
    description: str
    cameras: tuple[str, ...]
    views: tuple[str, ...]
    state_names: tuple[str, ...]
    action_names: tuple[str, ...]
    action_low: tuple[float, ...]
    action_high: tuple[float, ...]
    task_state_names: tuple[str, ...]
    environment_state_names: tuple[str, ...] = ()
    duration_s: float
    storage: Literal["image", "video"]
    settings: type[TaskSettings]
    simulation_version: int
    changes: Mapping[int, str]
    env_entry: str
    operator_entry: str
    measures_entry: str
    nearest_target_entry: str | None = None
    sticks_entry: str | None = None
    place_probe_entry: str | None = None
    task_state_tolerance: float
    judges_at_the_end: bool
    target_count: int = TARGETS_PER_SCENE
    default_target: int | None = None
    last_stage: int = 0
    cuts_rest: bool = False

    @property
    def env_type(self) -> str:
        """Name of the environment, as in `--env.type`."""
        return self.settings.ENV_TYPE

    @property
    def gym_id(self) -> str:
        """Id of the task in the registry of Gymnasium."""
        return f"lerobot_excav/{self.id}"

    @property
    def measures(self) -> "TaskMeasures":
        """What is measured of an episode, and how reports show it."""
        measures: TaskMeasures = resolve_name(self.measures_entry)
        return measures

    def make_settings(self, **values: Any) -> TaskSettings:
        """Make settings of this task; those left out have their defaults."""
        return self.settings.of({"task": self.id, **values})

    def make_env(self, **arguments: Any) -> Any:
        """Make the environment, a `MaskedTaskEnv`; see there for the arguments."""
        return resolve_name(self.env_entry)(**{"task": self.id, **arguments})

    def make_operator(self, rng: np.random.Generator) -> Operator:
        """Make a scripted operator, whose style is drawn from `rng`."""
        operator: Operator = resolve_name(self.operator_entry)(rng=rng)
        return operator

    def nearest_target(self, settings: TaskSettings, scene_id: int, stage: int = 0) -> int:
        """Return the target that is nearest at the start of a scene, at a stage."""
        assert self.nearest_target_entry is not None  # what offers the choice checks it
        return int(resolve_name(self.nearest_target_entry)(settings, scene_id, stage))

    def make_sticks(self) -> StickControl:
        """Make what turns the sticks' axes into actions."""
        assert self.sticks_entry is not None  # what offers sticks checks it
        sticks: StickControl = resolve_name(self.sticks_entry)()
        return sticks

    def make_place_probe(self, env: Any) -> PlaceProbe:
        """Make what tells where the machine acts, for an environment that was just reset."""
        assert self.place_probe_entry is not None  # what offers an audit checks it
        probe: PlaceProbe = resolve_name(self.place_probe_entry)(env)
        return probe

    def observation_space(self, obs_type: str, size: tuple[int, int]) -> gym.spaces.Dict:
        """Return the space of observations of one of `OBS_TYPES`; pictures are (height, width) [px]."""
        spaces: dict[str, gym.Space[Any]] = {"agent_pos": _unbounded(len(self.state_names))}
        if obs_type == "state":
            spaces["environment_state"] = _unbounded(len(self.environment_state_names))
        if obs_type == "pixels_agent_pos":
            image = gym.spaces.Box(0, 255, (*size, 3), np.uint8)
            spaces["pixels"] = gym.spaces.Dict(dict.fromkeys(self.cameras, image))
        return gym.spaces.Dict(spaces)

    @property
    def obs_types(self) -> tuple[str, ...]:
        """Those of `OBS_TYPES` that the task offers."""
        return tuple(name for name in OBS_TYPES if name != "state" or self.environment_state_names)

    @property
    def starts_per_scene(self) -> int:
        """With how many targets a scene is shown in turn, unless the user chooses one."""
        return self.target_count if self.default_target is None else 1

    def length_at(self, fps: int) -> int:
        """Return the time limit at a frame rate [frames]."""
        return round(self.duration_s * fps)

    def replay_length(self, frames: int) -> int:
        """Return the time limit [frames] under which a recording of this length is judged as it was."""
        return frames if self.judges_at_the_end else frames + 1


def _unbounded(size: int) -> gym.spaces.Box:
    return gym.spaces.Box(-np.inf, np.inf, (size,), np.float32)
