"""One played episode: how it is driven and what is kept of it."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.record.changes_of_mind import ChangesOfMind
from lerobot_excav.envs.tasks.commanded import Seen
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.selection import Schedule
from lerobot_excav.envs.tasks.task import Operator

TRACES = ("state", "action", "target_id", "command_frame", "task_state", "intervention")
"""What an episode holds of every frame, besides pictures."""


@dataclass(frozen=True, kw_only=True)
class Episode:
    """What was seen and done, frame by frame; everything is taken just before the frame's action.

    Attributes:
        pair: Start and the target that is commanded first.
        task: Task description.
        images: By camera, (n, H, W, 3) uint8; empty when the environment shows none.
        state: What the policy feels of the machine, (n, s) float32; names and units as its environment has them.
        action: What it was told, (n, a) float32.
        target_id: Target that is commanded, (n,) int64.
        command_frame: Frame from which on the command holds, (n,) int64.
        task_state: How far the task is, (n, k) float32.
        intervention: Whether a person had taken over from a policy, (n,) bool.
        outcome: How far the task is after the last action, and after the rest, (k,) float32.
        rest_frames: How many frames the machine was held still after the last action until the episode ended.
        success: Outcome of the episode.
        mask_missing_frames: Frames in which the machine was held still because no mask was found.
        metrics: Outcome part by part, after the last action.
        operator: Who commanded, one of `schema.OPERATORS`.
    """

    pair: Pair
    task: str
    images: dict[str, NDArray[Any]]
    state: NDArray[Any]
    action: NDArray[Any]
    target_id: NDArray[Any]
    command_frame: NDArray[Any]
    task_state: NDArray[Any]
    intervention: NDArray[Any]
    outcome: NDArray[Any]
    rest_frames: int
    success: bool
    mask_missing_frames: int
    metrics: dict[str, Any]
    operator: str = "scripted"

    @property
    def length(self) -> int:
        """Number of frames."""
        return len(self.action)


class EpisodeTape:
    """Takes an episode down, frame by frame."""

    def __init__(self) -> None:
        self._frames: list[dict[str, Any]] = []
        self._cameras: tuple[str, ...] = ()
        self._success = False
        self._metrics: dict[str, Any] = {}
        self._info: dict[str, Any] = {}

    @property
    def length(self) -> int:
        """Number of frames so far."""
        return len(self._frames)

    def add(self, observation: dict[str, Any], info: dict[str, Any], action: NDArray[Any]) -> None:
        """Take down what is seen and told before an action, and the action."""
        pixels = observation.get("pixels", {})
        self._cameras = tuple(pixels)
        self._frames.append(
            {
                **pixels,
                "state": np.asarray(observation["agent_pos"], dtype=np.float32),
                "action": action,
                "target_id": np.int64(info["target_id"]),
                "command_frame": np.int64(info["command_frame"]),
                "task_state": np.asarray(info["task_state"], dtype=np.float32),
            }
        )

    def note(self, info: dict[str, Any]) -> None:
        """Take down what is told after the last action."""
        self._success = self._success or bool(info["is_success"])
        self._metrics = info.get("episode_metrics", self._metrics)
        self._info = info

    def episode(self, pair: Pair, task: str, *, operator: str) -> Episode:
        """Return the episode; it has a frame at least."""
        columns = {key: np.stack([frame[key] for frame in self._frames]) for key in self._frames[0]}
        return Episode(
            pair=pair,
            task=task,
            images={camera: columns.pop(camera) for camera in self._cameras},
            outcome=np.asarray(self._info["task_state"], dtype=np.float32),
            rest_frames=0,
            success=self._success,
            mask_missing_frames=self._info["mask_missing_frames"],
            metrics=dict(self._metrics),
            operator=operator,
            intervention=np.zeros(self.length, dtype=np.bool_),
            **columns,
        )


def demonstrate(
    env: MaskedTaskEnv[Any, Any], operator: Operator, pair: Pair, changes: ChangesOfMind | None = None
) -> Episode:
    """Reset an environment to a pair's start and target, then the operator, and let it play to the end.

    With changes of mind another target is commanded on the way to the one before.
    Where the task says so, the last frames, in which the operator rests, are played but not returned.
    """
    rests: list[bool] = []

    def act(_: int) -> NDArray[Any]:
        action = operator.act(env)
        rests.append(env.task_spec.cuts_rest and bool(operator.done))  # type: ignore[attr-defined]  # see Operator
        return action

    def changed() -> Seen | None:
        return None if changes is None else changes.pass_frame(env, operator)

    options = dict(pair.reset_options)
    episode = _play(env, pair, options, reset=lambda: operator.reset(env), act=act, changed=changed)
    at_work = [frame for frame, is_rest in enumerate(rests) if not is_rest]
    return _without_rest(episode, 1 + max(at_work, default=0))


def replay(
    env: MaskedTaskEnv[Any, Any], action: NDArray[Any], pair: Pair, schedule: Schedule, *, rest_frames: int = 0
) -> Episode:
    """Play recorded actions again, all of them: a person may go on after the environment says that it is over.

    Args:
        env: Environment; it is reset to the pair's start and target.
        action: Actions, (n, a) float32.
        pair: Start and target.
        schedule: Changes of the command.
        rest_frames: For how many frames the machine is held still after them, unless the environment says before that
            it is over.

    Returns:
        The episode, without the frames in which the machine was held. Its `metrics` are empty unless the environment
        said that it is over.
    """
    options = {**pair.reset_options, "commands": schedule}

    def act(frame: int) -> NDArray[Any]:
        return np.asarray(action[frame] if frame < len(action) else env.holding_action())

    length = len(action)
    episode = _play(env, pair, options, reset=lambda: None, act=act, least=length, most=length + rest_frames)
    return _without_rest(episode, length)


def _play(
    env: MaskedTaskEnv[Any, Any],
    pair: Pair,
    options: dict[str, Any],
    *,
    reset: Callable[[], None],
    act: Callable[[int], NDArray[Any]],
    changed: Callable[[], Seen | None] = lambda: None,
    least: int = 0,
    most: float = math.inf,
) -> Episode:
    """Play until the episode ends, but at least and at most so many frames; `changed` may give a new command."""
    observation, info = env.reset(options=options)
    reset()
    tape, ended = EpisodeTape(), False
    while tape.length < least or (tape.length < most and not ended):
        observation, info = changed() or (observation, info)
        action = np.asarray(act(tape.length), dtype=np.float32)
        tape.add(observation, info, action)
        observation, _, terminated, truncated, info = env.step(action)
        tape.note(info)
        ended = terminated or truncated
    return tape.episode(pair, env.task_description, operator="scripted")


def _without_rest(episode: Episode, count: int) -> Episode:
    """Return an episode cut off after some frames, in the others of which the machine was held still."""
    traces = {name: getattr(episode, name)[:count] for name in TRACES}
    images = {camera: frames[:count] for camera, frames in episode.images.items()}
    return replace(episode, images=images, rest_frames=episode.length - count, **traces)
