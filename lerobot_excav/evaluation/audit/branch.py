"""One course of events in an audit: from a state that is repeated bit by bit on, under one of the masks."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from lerobot_excav.envs.tasks.acted_place import PlaceProbe
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.errors import ExcavError
from lerobot_excav.evaluation.audit.actor import Actor

Place = tuple[float, float]


class Branch(BaseModel):
    """What came of a mask.

    Attributes:
        scene_id: Scene.
        moment: At which moment of the episode the mask was given.
        frame: Frame of that moment.
        target_id: Target that the mask shows from then on.
        actions: Actions from then on, (n, a).
        tool_path_w: Where the tool was before each of them, (n, 3) [m], world frame.
        commanded_w: Middle of the target on the ground plane (2,) [m].
        began_frame: Frame in which acting began, since the start of the episode; None if it did not, as with the rest.
        began_w: Where the tool was then (2,) [m].
        acted_w: Where the world was changed (2,) [m].
        share: Which part of the change lies where the mask is.
        is_success: Whether the episode succeeded.
    """

    model_config = ConfigDict(strict=True, extra="forbid")

    scene_id: int
    moment: str
    frame: int
    target_id: int
    actions: list[list[float]]
    tool_path_w: list[list[float]]
    commanded_w: Place
    began_frame: int | None
    began_w: Place | None
    acted_w: Place | None
    share: float | None
    is_success: bool


class Prefix:
    """The beginning of an episode that others repeat: its actions, and the states that they must lead to.

    Attributes:
        target_id: Target that was commanded in it.
        actions: Its actions.
    """

    def __init__(self, target_id: int) -> None:
        self.target_id = target_id
        self.actions: list[NDArray[np.float32]] = []
        self._states: list[NDArray[np.float32]] = []

    def add(self, state: NDArray[np.float32], action: NDArray[np.float32]) -> None:
        """Append a frame: what the policy felt of the machine, and what it commanded."""
        self._states.append(state.copy())
        self.actions.append(action.copy())

    def require_state(self, frame: int, state: NDArray[np.float32]) -> None:
        """Check that a repetition has led to the same state.

        Raises:
            ExcavError: It has not, so that what follows would not be caused by the mask alone.
        """
        if not np.array_equal(self._states[frame], state):
            raise ExcavError(
                f"the state of frame {frame} is not the one that the same actions led to before; this environment does "
                "not repeat itself, so it cannot be audited"
            )


@dataclass(frozen=True, kw_only=True)
class State:
    """A state that branches begin from.

    Attributes:
        scene_id: Scene.
        stage: Stage of the scene.
        moment: Name of the moment.
        prefix: Episode that is repeated at first; None for the start itself.
        frame: How many of its frames.
    """

    scene_id: int
    stage: int = 0
    moment: str = "start"
    prefix: Prefix | None = None
    frame: int = 0

    def reach(self, env: MaskedTaskEnv[Any, Any], target_id: int) -> tuple[dict[str, Any], "Watch"]:
        """Bring an environment into this state, with the mask of a target from here on; return what is observed.

        Raises:
            TargetAbsentError: The scene has no such target.
            ExcavError: The environment does not repeat itself.
        """
        first_id = target_id if self.prefix is None else self.prefix.target_id
        commands = [(self.frame, target_id)] if first_id != target_id else []
        start = {"scene_id": self.scene_id, "stage": self.stage, "target_id": first_id, "commands": commands}
        observation, _ = env.reset(options=start)
        watch = Watch(env.task_spec.make_place_probe(env))
        if self.prefix is None:
            return observation, watch
        for action in self.prefix.actions[: self.frame]:
            observation, *_ = env.step(action)
            watch.update()
        self.prefix.require_state(self.frame, observation["agent_pos"])
        return observation, watch


class Watch:
    """Follows an episode, and notes when acting begins.

    Attributes:
        probe: What tells where the machine acts.
        began_frame: Frame in which acting began, since the start; None before.
    """

    def __init__(self, probe: PlaceProbe) -> None:
        self.probe = probe
        self.began_frame: int | None = None
        self._frame = 0

    def update(self) -> None:
        """Take in the frame that has just passed."""
        self.probe.update()
        self._frame += 1
        if self.began_frame is None and self.probe.has_begun:
            self.began_frame = self._frame

    def acted(self) -> dict[str, Any]:
        """Return the fields of a branch that say where the machine has acted."""
        acted = self.probe.acted()
        if acted is None:
            return dict.fromkeys(("began_frame", "began_w", "acted_w", "share"))
        places = {"began_w": _place(acted.began_w), "acted_w": _place(acted.acted_w)}
        return {"began_frame": self.began_frame, **places, "share": round(acted.share, 4)}


def play_branch(
    env: MaskedTaskEnv[Any, Any],
    actor: Actor,
    state: State,
    target_id: int,
    *,
    most_frames: float = math.inf,
    record: Prefix | None = None,
) -> Branch:
    """Let an actor act from a state on, under the mask of a target.

    Args:
        env: Environment with pictures.
        actor: Who acts.
        state: Where it begins.
        target_id: Target of the mask.
        most_frames: Most frames that follow; to the end of the episode if left out.
        record: Takes what was felt and done.

    Raises:
        TargetAbsentError: The scene has no such target.
        ExcavError: The environment does not repeat itself.
    """
    observation, watch = state.reach(env, target_id)
    actor.begin(env)
    commanded_w = watch.probe.commanded_w
    actions: list[NDArray[np.float32]] = []
    path_w: list[NDArray[np.float64]] = []
    is_over = is_success = False
    while not is_over and len(actions) < most_frames:
        action = actor.act(env, observation)
        if record is not None:
            record.add(observation["agent_pos"], action)
        actions.append(action)
        path_w.append(watch.probe.tool_pos_w)
        observation, _, terminated, truncated, info = env.step(action)
        is_over, is_success = terminated or truncated, bool(info["is_success"])
        watch.update()
    return Branch(
        scene_id=state.scene_id,
        moment=state.moment,
        frame=state.frame,
        target_id=target_id,
        actions=_rounded(actions, 4),
        tool_path_w=_rounded(path_w, 3),
        commanded_w=_place(commanded_w),
        is_success=is_success,
        **watch.acted(),
    )


def _rounded(rows: Sequence[NDArray[Any]], digits: int) -> list[list[float]]:
    return [[round(float(value), digits) for value in row] for row in rows]


def _place(point_w: NDArray[np.float64]) -> Place:
    return round(float(point_w[0]), 4), round(float(point_w[1]), 4)
