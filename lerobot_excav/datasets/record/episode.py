"""One played episode: how it is driven and what is kept of it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.datasets.format.pair import Pair


class Environment(Protocol):
    """What an episode needs of an environment."""

    task_description: str

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode."""

    def step(self, action: NDArray[Any]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance by one frame."""

    def close(self) -> None:
        """Free what the environment holds."""


class Operator(Protocol):
    """What an episode needs of an operator."""

    def reset(self, env: Any) -> None:
        """Look at a freshly reset environment."""

    def act(self, env: Any) -> NDArray[Any]:
        """Return the next action, float32 (a,)."""


@dataclass(frozen=True, kw_only=True)
class Episode:
    """What was seen and done, frame by frame; everything is taken just before the frame's action.

    Attributes:
        pair: Scene and target.
        task: Task description.
        images: By camera, (n, H, W, 3) uint8; empty when the environment shows none.
        state: What the policy feels of the machine, (n, s) float32; names and units as its environment has them.
        action: What it was told, (n, a) float32.
        task_state: How far the task is, (n, k) float32.
        success: Outcome of the episode.
        metrics: Outcome part by part, after the last action.
    """

    pair: Pair
    task: str
    images: dict[str, NDArray[Any]]
    state: NDArray[Any]
    action: NDArray[Any]
    task_state: NDArray[Any]
    success: bool
    metrics: dict[str, Any]

    @property
    def length(self) -> int:
        """Number of frames."""
        return len(self.action)


def demonstrate(env: Environment, operator: Operator, pair: Pair) -> Episode:
    """Let an operator play an episode to its end.

    Args:
        env: Environment; it is reset to the pair's scene and target.
        operator: Operator; it is reset once the environment is.
        pair: Scene and target.
    """
    return _play(env, pair, reset=lambda: operator.reset(env), act=lambda _: operator.act(env))


def replay(env: Environment, action: NDArray[Any], pair: Pair) -> Episode:
    """Play recorded actions again, all of them: a person may go on after the environment says that it is over.

    Args:
        env: Environment; it is reset to the pair's scene and target.
        action: Actions, (n, a) float32.
        pair: Scene and target.

    Returns:
        The episode. Its `metrics` are empty unless the environment said that it is over.
    """
    return _play(env, pair, reset=lambda: None, act=lambda frame: action[frame], length=len(action))


def _play(
    env: Environment,
    pair: Pair,
    *,
    reset: Callable[[], None],
    act: Callable[[int], NDArray[Any]],
    length: int | None = None,
) -> Episode:
    """Play `length` frames, or by default until the episode ends."""
    observation, info = env.reset(options={"scene_id": pair.scene_id, "target_id": pair.target_id})
    reset()
    frames: list[dict[str, Any]] = []
    metrics: dict[str, Any] = {}
    success, ended = False, False
    while (not ended) if length is None else len(frames) < length:
        action = np.asarray(act(len(frames)), dtype=np.float32)
        frames.append(_frame(observation, info, action))
        observation, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
        success = success or bool(info["is_success"])
        metrics = info.get("episode_metrics", metrics)
    columns = {key: np.stack([frame[key] for frame in frames]) for key in frames[0]}
    cameras = observation.get("pixels", {})
    return Episode(
        pair=pair,
        task=env.task_description,
        images={camera: columns.pop(camera) for camera in cameras},
        success=success,
        metrics=dict(metrics),
        **columns,
    )


def _frame(observation: dict[str, Any], info: dict[str, Any], action: NDArray[Any]) -> dict[str, Any]:
    return {
        **observation.get("pixels", {}),
        "state": np.asarray(observation["agent_pos"], dtype=np.float32),
        "action": action,
        "task_state": np.asarray(info["task_state"], dtype=np.float32),
    }
