"""Opening the console: an environment, perhaps a policy and a recording, and the page."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lerobot_excav.console.console import Console
from lerobot_excav.console.pilot import Actor, Pilot
from lerobot_excav.console.recorder import Recorder
from lerobot_excav.console.recording import Recording
from lerobot_excav.console.wishes import grant, show_next
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.registry import task_of_settings
from lerobot_excav.envs.tasks.settings import ENDLESS_FRAMES, TaskSettings
from lerobot_excav.errors import ConfigurationError, require
from lerobot_excav.page.access import Access
from lerobot_excav.page.drivers_seat import DriversSeat
from lerobot_excav.page.feed import Feed
from lerobot_excav.page.server import PageServer


@dataclass(kw_only=True)
class OpenConsole:
    """A console that is being served.

    Attributes:
        console: The loop behind the page; `run` it in the thread that opened it.
        address: Address of the page, with its token.
    """

    console: Console
    address: str


@contextmanager
def open_console(
    schedule: DemonstrationSettings,
    *,
    access: Access,
    size: tuple[int, int],
    speed: float = 1.0,
    policy: Path | None = None,
    out: Path | None = None,
    say: Callable[[str], None] = lambda words: None,
) -> Iterator[OpenConsole]:
    """Serve the page of an environment while the block runs.

    Args:
        schedule: The environment, and the starts that are shown and recorded, in their order.
        access: Where it is served, and who may come in.
        size: Height and width of the live pictures [px].
        speed: How fast the world is beside real time.
        policy: `pretrained_model` folder of a policy that may work.
        out: Folder of the dataset to record; None records nothing.
        say: Told what takes long.

    Raises:
        ConfigurationError: The task cannot be driven by sticks, or the policy does not fit.
        DatasetError: `out` is in the way.
        DeviceError: The address is taken.
    """
    spec = task_of_settings(schedule.env)
    require(
        schedule.env.episode_length is None,
        f"--env.episode_length={schedule.env.episode_length} has no effect: a person ends an episode; leave it out",
    )
    retarget_frame = getattr(schedule.env, "retarget_frame", None)
    require(
        retarget_frame is None,
        f"--env.retarget_frame={retarget_frame} has no place on the page, where a person points; leave it out",
    )
    require(spec.sticks_entry is not None, f"{spec.id} does not say what sticks do to its machine")
    recording = None if out is None else Recording(schedule, out)
    env: MaskedTaskEnv[Any, Any] = spec.make_env(**{**schedule.env.as_dict(), "episode_length": ENDLESS_FRAMES})
    seat, feed = DriversSeat(), Feed()
    if policy is not None:
        say(f"loading {policy} ...")
    actor, name = (None, None) if policy is None else (_policy(policy, schedule.env), policy.resolve().name)
    pilot = Pilot(env, seat, spec.make_sticks(), policy=actor, policy_name=name)
    console = Console(env, seat, feed, pilot=pilot, recorder=Recorder(recording), grant=grant, size=size, speed=speed)
    try:
        with PageServer(access, feed, seat).running():
            if recording is None or show_next(console, recording) is None:
                console.start(**schedule.pairs()[0].reset_options)
            console.show()
            yield OpenConsole(console=console, address=access.address)
    finally:
        console.close()
        env.close()


def _policy(checkpoint: Path, settings: TaskSettings) -> Actor:
    """Load a policy, and check that it is one for this machine; LeRobot is imported here alone: it takes seconds."""
    from lerobot_excav.evaluation.audit.actor import PolicyActor, policy_config, require_same_machine

    require_same_machine(policy_config(checkpoint), settings)
    try:
        return PolicyActor(checkpoint)
    except OSError as error:
        raise ConfigurationError(f"--policy={checkpoint} cannot be loaded: {error}") from error


@contextmanager
def until_interrupted() -> Iterator[Callable[[], bool]]:
    """Provide a function that tells whether Ctrl-C was pressed or the process was asked to end."""
    asked = threading.Event()
    before = {number: signal.signal(number, lambda *_: asked.set()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield asked.is_set
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
