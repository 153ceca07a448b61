"""The loop behind the page: time passes in it, wishes are granted, and every moment is shown."""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.console.pilot import STILL, WORK, Pilot
from lerobot_excav.console.recorder import Recorder
from lerobot_excav.envs.tasks.commanded import Seen
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.errors import ExcavError
from lerobot_excav.page.drivers_seat import DriversSeat
from lerobot_excav.page.feed import Feed
from lerobot_excav.page.live_views import LiveViews
from lerobot_excav.page.scene_state import scene_state
from lerobot_excav.page.target_marks import target_marks
from lerobot_excav.page.wishes import Wish

logger = logging.getLogger(__name__)

IDLE_FPS = 5
"""Moments a second while time stands still (kind: guess)."""

LONGEST_EPISODE_S = 600.0
"""Simulated time after which a recorded episode is finished [s]: somebody has left; its frames fill the memory (kind:
guess)."""

SHOWN_FPS = 10
"""Pictures a second at most; drawing them takes 35 ms on a machine without a graphics card (kind: measured)."""


class Console:
    """Lets one page drive an environment in real time, and all pages see it.

    Time stands still until somebody drives or a policy works. One frame is 1/fps s; where a frame takes longer than
    that to compute, the world is slower than real time, and the page says by how much.

    Args:
        env: The environment, with pictures.
        seat: Who drives.
        feed: Where moments are published.
        pilot: Who acts.
        recorder: Takes episodes down.
        grant: Does what a page wishes, or raises an `ExcavError` that says why not.
        size: Height and width of the pictures [px].
        speed: How fast the world is beside real time; below 1 it is slow motion.
        offers: What the page may wish for; by default what makes sense with this policy and this recorder.
    """

    def __init__(
        self,
        env: MaskedTaskEnv[Any, Any],
        seat: DriversSeat,
        feed: Feed,
        *,
        pilot: Pilot,
        recorder: Recorder,
        grant: Callable[["Console", Wish], None],
        size: tuple[int, int],
        speed: float = 1.0,
        offers: Sequence[str] | None = None,
    ) -> None:
        self.env, self.seat, self.feed, self.pilot, self.recorder = env, seat, feed, pilot, recorder
        self._grant, self._speed_asked = grant, speed
        self._offers = list(self._default_offers() if offers is None else offers)
        self._views = LiveViews(env, height=size[0], width=size[1])
        self._words, self._is_fault = "", False
        self._start: dict[str, Any] | None = None  # of the running episode
        self._pictures: dict[str, bytes] = {}
        self._marks: list[dict[str, Any]] = []
        self._is_new = True  # whether the scene looks otherwise than shown
        self._shown_frame, self._sticks_number = 0, -1
        self._generation = seat.generation
        self._share = 1.0  # of the speed that is asked for, as far as this machine reaches it
        self._acted: NDArray[np.float32] | None = None

    def start(self, **options: Any) -> None:
        """Begin an episode; `options` are those of the environment's `reset`.

        Raises:
            ConfigurationError: A value is not possible; the start before is shown again.
        """
        self.pilot.rest()
        self._acted = None
        try:
            self.observation, self.info = self.env.reset(options=dict(options))
        except ExcavError:
            if self._start is None:
                raise
            self.observation, self.info = self.env.reset(options=self._start)
            self.look()
            raise
        self._start = dict(options)
        self._shown_frame = 0
        self.look()

    def look(self, seen: Seen | None = None) -> None:
        """Show the scene again, whose command or contents have changed; `seen` is observation and info."""
        if seen is not None:
            self.observation, self.info = seen
        self._marks = target_marks(self.env)
        self._views.redraw_plan()
        self._is_new = True

    def say(self, words: str, *, is_fault: bool = False) -> None:
        """Tell the page something."""
        self._words, self._is_fault = words, is_fault

    def run(self, is_over: Callable[[], bool]) -> None:
        """Serve until it is over."""
        due_s = time.monotonic()
        while not is_over():
            has_passed = self.tick()
            is_awake = has_passed or self.pilot.mode != STILL  # the first motion of the sticks is noticed at once
            period_s = 1.0 / (self._speed_asked * self.env.fps if is_awake else IDLE_FPS)
            due_s, now_s = due_s + period_s, time.monotonic()
            if has_passed:
                late_s = max(0.0, now_s - due_s)
                self._share += 0.1 * (period_s / (period_s + late_s) - self._share)
            due_s = max(due_s, now_s)  # what is lost is not made up for
            self._wait_until(due_s)

    def tick(self) -> bool:
        """Grant what was wished for, let a frame pass if somebody acts, show the moment; tell whether one passed."""
        self._grant_wishes()
        has_passed = self._pass_frame()
        self.show()
        return has_passed

    def close(self) -> None:
        """Free the graphics context, and let go of the recording."""
        self._views.close()
        self.recorder.close()

    def _wait_until(self, due_s: float) -> None:
        while (left_s := due_s - time.monotonic()) > 0.0:
            time.sleep(min(left_s, 0.02))

    def _grant_wishes(self) -> None:
        wishes = self.seat.wishes()
        for wish in wishes:
            self.say("")
            with self._faults_told():
                self._grant(self, wish)
        if wishes:
            self.seat.wishes()  # what was asked for while the page could not see that it was heard
        if self.seat.generation != self._generation:
            self._generation = self.seat.generation
            self._stop("stopped: the controls were given up, or taken by another page")
        elif self.pilot.mode == WORK and not self.seat.is_heard():
            self._stop("stopped: the page that has the controls is not heard any more")

    @contextmanager
    def _faults_told(self) -> Iterator[None]:
        """Let nothing end the console: what goes wrong is told."""
        try:
            yield
        except (ExcavError, OSError) as error:
            self.say(str(error), is_fault=True)
        except Exception as error:
            logger.exception("the console goes on after a fault")
            self.say(f"a fault of the program, told in its window: {error!r}", is_fault=True)

    def _stop(self, words: str) -> None:
        if self.pilot.mode != STILL:
            self.pilot.rest()
            self.say(words, is_fault=True)

    def _pass_frame(self) -> bool:
        """Let a frame pass if somebody acts; tell whether it did."""
        if self.env.is_over or self.recorder.is_waiting_for_a_verdict:
            self.pilot.rest()
        mode = self.pilot.mode
        with self._faults_told():
            action = self.pilot.act(self.observation)
            if action is None:
                return False
            if self.pilot.mode != mode:
                self.say("you have taken over; hand back, or drive on")
            self._carry_out(action)
            return True
        self.pilot.rest()  # after a fault
        return False

    def _carry_out(self, action: NDArray[np.float32]) -> None:
        command_frame = self.info["command_frame"]
        self._step(action, by_policy=self.pilot.mode == WORK)
        if self.env.is_over:
            self.finish_episode()
        elif self.info["command_frame"] != command_frame:
            self._note_command()
        elif self.recorder.length >= round(LONGEST_EPISODE_S * self.env.fps):
            self.finish_episode()
            self.say(f"finished: an episode is recorded for {LONGEST_EPISODE_S:.0f} s at most", is_fault=True)

    def _step(self, action: NDArray[np.float32], *, by_policy: bool) -> None:
        """Let a frame pass, and take it down."""
        self.recorder.add(self.observation, self.info, action, by_policy=by_policy)
        self.observation, *_, self.info = self.env.step(action)
        self._acted, self._is_new = action, True
        self.recorder.note(self.info)

    def _note_command(self) -> None:
        """Show the command that the task has just given."""
        self.look()
        if self.pilot.works_once:
            self.pilot.rest()
            self.say("the cycle is over; point where to dig next, or let the planner's choice stand")
        else:
            self.say("the cycle is over; the planner commands the next region")

    def finish_episode(self) -> None:
        """End the episode in hand, as its outcome is now."""
        by_policy = self.pilot.mode == WORK
        self.pilot.rest()
        if self.recorder.is_running and not self.env.is_over and self.info["command_frame"] == self.env.frame > 0:
            # A replay gives no command after the last frame, so one more passes under it, or its task state differs.
            self._step(np.asarray(self.env.holding_action(), np.float32), by_policy=by_policy)
        self.recorder.finish(self.env.task_description, success=self.env.is_success)
        caption = self.env.caption
        self.say(f"the episode is over: {caption.outcome or 'the task is not done'}", is_fault=not self.env.is_success)

    # What is shown.

    def show(self) -> None:
        """Publish the present moment."""
        every = max(1, round(self.env.fps / SHOWN_FPS))
        self._shown_frame += 1
        if self._is_new and (self.pilot.mode == STILL or self._shown_frame % every == 0 or not self._pictures):
            self._pictures, self._is_new = self._views.pictures(self.observation), False
            self._sticks_number = self.pilot.sticks_number
        self.feed.publish(self._state(), self._pictures)

    def _state(self) -> dict[str, Any]:
        scene = scene_state(
            self.env,
            self.seat,
            legend=self.pilot.legend,
            marks=self._marks,
            sticks_number=self._sticks_number,
            acted=self._acted,
        )
        return scene | {
            "views": list(self._pictures),
            "mode": self.pilot.mode,
            "policy": self.pilot.policy_name,
            "taken_over": self.pilot.has_taken_over,
            "recording": self.recorder.state(),
            "offers": self._offers,
            "words": self._words,
            "fault": self._is_fault,
            "speed": round(self._speed_asked * self._share, 2),
        }

    def _default_offers(self) -> list[str]:
        offers = ["point", "paint", "target", "start", "drive", "stop"]
        if self.pilot.policy_name is not None:
            offers.append("work")
        if self.recorder.recording is not None:
            offers += ["record", "finish", "keep", "again", "skip", "complete"]
        return offers
