"""Consoles without a page: the tests sit in the driver's seat themselves, and time passes as they say."""

import itertools

import numpy as np
import pytest

from lerobot_excav.console.console import Console
from lerobot_excav.console.pilot import Pilot
from lerobot_excav.console.recorder import Recorder
from lerobot_excav.console.recording import Recording
from lerobot_excav.console.wishes import grant
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.envs.tasks.registry import task_of_settings
from lerobot_excav.envs.tasks.settings import ENDLESS_FRAMES
from lerobot_excav.envs.tasks.sticks import StickResponse
from lerobot_excav.page.drivers_seat import DriversSeat
from lerobot_excav.page.feed import Feed
from lerobot_excav.page.sticks import CENTRED_MESSAGES
from lerobot_excav.page.wishes import Wish
from validation.page_operator.pad import axes_of

PAGE = 1
CENTRE = [0.0] * 4


class Driver:
    """Sits in the driver's seat of a console."""

    def __init__(self, console):
        self.console, self.seat = console, console.seat
        self._numbers, self.now_s = itertools.count(), 0.0
        self.seat.clock = lambda: self.now_s  # however slow the machine is that tests
        self.seat.take(PAGE)
        console.tick()  # takes note of who drives
        self.seat.response = StickResponse(dead_zone=0.0)
        self.centre()
        console.tick()

    def centre(self):
        for _ in range(CENTRED_MESSAGES):
            self.hold(CENTRE)

    def hold(self, axes):
        self.now_s += 0.02
        self.seat.report(PAGE, list(axes), next(self._numbers), lost=False)

    def wish(self, kind, **values):
        self.hold(CENTRE)
        self.seat.wish(PAGE, Wish(kind=kind, **values))
        self.tick()

    def tick(self, axes=None, times=1):
        """Let time pass with the sticks held somewhere; return how many frames of the world passed."""
        passed = 0
        for _ in range(times):
            self.hold(CENTRE if axes is None else axes)
            passed += self.console.tick()
        return passed

    def dig(self, frames=None):
        """Drive as the scripted operator does, until the episode is over or for some frames."""
        env = self.console.env
        operator = env.task_spec.make_operator(np.random.default_rng(0))
        operator.reset(env)
        for _ in range(frames or 250):
            self.tick(axes_of(operator.act(env)))
            if env.is_over:
                return

    @property
    def state(self):
        return self.console.feed._moment.state

    @property
    def pictures(self):
        return self.console.feed._moment.pictures


class Planted:
    """A policy that curls the bucket, and counts how often it has begun."""

    def __init__(self):
        self.begun = 0

    def begin(self, env):
        self.begun += 1

    def act(self, env, observation):
        return np.array([0.0, 0.0, 0.0, -0.25], np.float32)


@pytest.fixture
def open_driver():
    """Open a console of an environment, by its name and settings; return its driver."""
    opened = []

    def _open(env_type="excavator", *, out=None, policy=None, env=None, **schedule):
        fast = {"fidelity": "fast"} if env_type == "excavator" else {}
        settings = DemonstrationSettings.of(
            env_type, {**fast, **(env or {})}, keep_failures=True, **{"scenes": 1, **schedule}
        )
        spec = task_of_settings(settings.env)
        world = spec.make_env(**{**settings.env.as_dict(), "episode_length": ENDLESS_FRAMES})
        seat = DriversSeat()
        pilot = Pilot(world, seat, spec.make_sticks(), policy=policy, policy_name=policy and "planted")
        recorder = Recorder(None if out is None else Recording(settings, out))
        console = Console(world, seat, Feed(), pilot=pilot, recorder=recorder, grant=grant, size=(96, 128))
        console.start(**settings.pairs()[0].reset_options)
        opened.append((console, world))
        return Driver(console)

    yield _open
    for console, world in opened:
        console.close()
        world.close()
