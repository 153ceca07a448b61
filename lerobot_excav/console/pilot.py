"""Who acts now: nobody, a person with the sticks, or a policy."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.sticks import Legend, StickControl
from lerobot_excav.errors import ConfigurationError, ExcavError, require
from lerobot_excav.page.drivers_seat import DriversSeat

STILL, DRIVE, WORK = "still", "drive", "work"
"""Time stands still; a person drives; a policy works."""

Action = NDArray[np.float32]


class Actor(Protocol):
    """Whoever may work by itself: a policy, or the actions of a recording."""

    def begin(self, env: MaskedTaskEnv[Any, Any]) -> None:
        """Start from the present state, without a memory of what was before."""

    def act(self, env: MaskedTaskEnv[Any, Any], observation: dict[str, Any]) -> Action | None:
        """Return the next action, (actions,); None when there is nothing more to do."""


class Pilot:
    """Decides frame by frame whose action counts.

    Args:
        env: The environment.
        seat: The sticks of the page that drives.
        sticks: What they mean to the machine.
        policy: A policy that may work; None if there is none.
        policy_name: Its name for people.

    Attributes:
        mode: `still`, `drive` or `work`.
        has_taken_over: Whether a person has taken the controls from the policy, and has them.
        works_once: Whether the policy is to stop where its command changes.
        sticks_number: Number of the message of the sticks that has acted last.
    """

    def __init__(
        self,
        env: MaskedTaskEnv[Any, Any],
        seat: DriversSeat,
        sticks: StickControl,
        *,
        policy: Actor | None = None,
        policy_name: str | None = None,
    ) -> None:
        self._env, self._seat, self._sticks, self._policy = env, seat, sticks, policy
        self.policy_name = policy_name
        self.mode, self.has_taken_over, self.works_once = STILL, False, False
        self._waits, self.sticks_number = False, -1

    @property
    def legend(self) -> Legend:
        """What each axis does, by pattern."""
        return self._sticks.legend

    def rest(self) -> None:
        """Let time stand still."""
        self.mode, self.has_taken_over, self.works_once = STILL, False, False

    def drive(self) -> None:
        """Give the controls to the person; time passes from the first motion of the sticks on.

        Raises:
            ConfigurationError: The episode is over.
        """
        self._require_running()
        self._sticks.reset(self._env)
        self.has_taken_over = self.mode == WORK or self.has_taken_over
        self.works_once = False
        self._waits = self.mode == STILL or (self.mode == DRIVE and self._waits)
        self.mode = DRIVE

    def work(self, *, once: bool = False) -> None:
        """Let the policy work from here on, without a memory of what was before; `once`: until the command changes.

        Raises:
            ConfigurationError: There is no policy, or the episode is over.
        """
        self._require_running()
        if self._policy is None:
            raise ConfigurationError("no policy is loaded; start the console with --policy=FOLDER of a checkpoint")
        self._policy.begin(self._env)
        self.mode, self.has_taken_over, self.works_once = WORK, False, once

    def act(self, observation: dict[str, Any]) -> Action | None:
        """Return the action of the next frame; None while time stands still.

        Raises:
            ExcavError: The policy has failed.
        """
        axes, number = self._seat.axes()
        if self.mode == WORK and self._seat.wants_controls():
            self.drive()
        if self.mode == WORK:
            return self._act_of_policy(observation)
        if self.mode == STILL or not self._seat.sticks.is_ready:
            return None
        response = self._seat.response
        if self._waits and not any(response.of(axes, axis) for axis in axes):
            return None
        self._waits, self.sticks_number = False, number
        return self._sticks.action(axes, response)

    def _act_of_policy(self, observation: dict[str, Any]) -> Action | None:
        assert self._policy is not None  # or `work` had refused
        try:
            action = self._policy.act(self._env, observation)
        except Exception as error:  # it is someone else's
            raise ExcavError(f"the policy {self.policy_name} has failed: {' '.join(str(error).split())}") from error
        if action is None:  # a recording is over
            self.rest()
            return None
        if not np.isfinite(action).all():
            raise ExcavError(f"the policy {self.policy_name} has failed: its action is not finite")
        return action

    def _require_running(self) -> None:
        require(not self._env.is_over, "the episode is over; start the scene again, or take another one")
