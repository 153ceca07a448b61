"""What demonstrations and datasets need to know of an environment, gathered in one place per environment.

`environments` lists them. Whatever differs between environments is asked for here or made by their rigs; elsewhere in
this package the excavator is named only where it is the default, or where its first, unmarked data are read.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import pandas as pd
from numpy.typing import NDArray

from lerobot_excav.datasets.record.rig import Rig


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A setting that only some environments have; each has a dataset column `excav.<name>`.

    Attributes:
        default: Its value unless another is asked for.
        choices: Allowed values.
        unmarked: What datasets without the column are taken to hold there.
    """

    default: str
    choices: tuple[str, ...]
    unmarked: str


class RigMaker(Protocol):
    """Makes the rig of an environment."""

    def __call__(self, *, with_images: bool = True) -> Rig:
        """Make a rig that draws pictures, or one that does not and is faster."""


@dataclass(frozen=True, kw_only=True)
class EnvironmentDescription:
    """One environment, as datasets see it.

    Attributes:
        name: As in `--env.type`.
        robot_type: Of its datasets, as the simulated robot writes it when `lerobot-record` records.
        tasks: Names of its tasks; the first is the default.
        cameras: Names of the pictures.
        state_names: Elements of `observation.state`.
        action_names: Elements of `action`.
        action_limits: Least and greatest value of every element of an action, (2, n).
        task_state_names: Elements of `excav.task_state`.
        fps: Frames per second by default.
        duration_s: Time limit by default [s].
        storage: How pictures are stored by default, one of `storage.STORAGES`.
        settings: Settings that not every environment has, by name.
        simulation_version: Version of the simulation; see its `simulation_version.py`.
        changes: What each of its versions is, or changed.
        unmarked_version: Version that data without one are taken to be of; None if all of its data say theirs.
        nearest_target: Returns the target that a scene (set and number) offers as the nearest one; None if the
            environment defines no such thing.
        outcome: Turns the task states of an episode, (n, k), into columns of the index.
        summary: Describes the outcomes of an index in a few words.
        rig: Makes environment and operator.
        task_state_tolerance: Deviation of a task state that a replay may have, in the state's own unit.
        judges_at_the_end: Whether success is judged at the time limit only, so that a replay must end there.
    """

    name: str
    robot_type: str
    tasks: tuple[str, ...]
    cameras: tuple[str, ...]
    state_names: tuple[str, ...]
    action_names: tuple[str, ...]
    action_limits: NDArray[Any]
    task_state_names: tuple[str, ...]
    fps: int
    duration_s: float
    storage: str
    settings: Mapping[str, Setting]
    simulation_version: int
    changes: Mapping[int, str]
    unmarked_version: int | None
    nearest_target: Callable[[str, int], int] | None
    outcome: Callable[[NDArray[Any]], dict[str, Any]]
    summary: Callable[[pd.DataFrame], str]
    rig: RigMaker
    task_state_tolerance: float
    judges_at_the_end: bool

    def length_at(self, fps: int) -> int:
        """Return the time limit by default at a frame rate [frames]."""
        return round(self.duration_s * fps)

    def replay_length(self, frames: int) -> int:
        """Return the time limit [frames] under which a recording of this length is judged as it was."""
        return frames if self.judges_at_the_end else frames + 1

    @property
    def defaults(self) -> dict[str, Any]:
        """Default by name of every setting whose default depends on the environment."""
        return {
            "task": self.tasks[0],
            "fps": self.fps,
            "episode_length": self.length_at(self.fps),
            "storage": self.storage,
            **{name: setting.default for name, setting in self.settings.items()},
        }
