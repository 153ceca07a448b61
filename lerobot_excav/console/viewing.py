"""Looking at a recorded episode: the simulation plays its actions again, on the console's page."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.console.console import Console
from lerobot_excav.console.opening import OpenConsole
from lerobot_excav.console.pilot import Pilot
from lerobot_excav.console.recorder import Recorder
from lerobot_excav.datasets.format.dataset_info import read_info
from lerobot_excav.datasets.format.episode_table import EpisodeTable, iterate_episodes
from lerobot_excav.datasets.pairs.paired_index import index_keys
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.errors import require
from lerobot_excav.page.access import Access
from lerobot_excav.page.drivers_seat import DriversSeat
from lerobot_excav.page.feed import Feed
from lerobot_excav.page.server import PageServer
from lerobot_excav.page.wishes import Wish

OFFERS = ("work", "stop", "again", "next")
"""Play, pause, from the start, the next episode."""


@dataclass
class RecordedActions:
    """Acts as in an episode that was recorded.

    Attributes:
        action: Its actions, (n, a).
    """

    action: NDArray[Any]

    def begin(self, env: MaskedTaskEnv[Any, Any]) -> None:
        """Do nothing: what comes next depends on the frame alone."""

    def act(self, env: MaskedTaskEnv[Any, Any], observation: dict[str, Any]) -> NDArray[np.float32] | None:
        """Return the action of the present frame; None behind the last one."""
        return np.asarray(self.action[env.frame], np.float32) if env.frame < len(self.action) else None


class Viewer:
    """Shows one episode of a dataset after the other.

    Args:
        root: The dataset.
        episode: The first one to show.

    Raises:
        DatasetError: The dataset or the episode cannot be read, or has not the columns of this package.
        ConfigurationError: There is no such episode.
    """

    def __init__(self, root: Path, episode: int) -> None:
        self._root, self._info = root, read_info(root)
        count = self._info.total_episodes
        require(episode < count, f"--episode={episode} does not exist; {root} has {count}, from 0")
        self.table = self._read(episode)
        self.actor = RecordedActions(self.table.action)

    def make_env(self) -> MaskedTaskEnv[Any, Any]:
        """Make the environment of the episode that is shown."""
        table = self.table
        spec = table.spec
        length = spec.replay_length(table.length + table.rest_frames)
        settings = {"scene_set": table.pair.scene_set, "fps": self._info.fps, "episode_length": length}
        env: MaskedTaskEnv[Any, Any] = spec.make_env(**settings, **table.settings)
        return env

    def show(self, console: Console) -> None:
        """Show the start of the episode."""
        table = self.table
        console.start(**table.pair.reset_options, commands=table.schedule)
        words = "success" if table.success else "no success"
        console.say(
            f"episode {table.index} of {self._info.total_episodes}: {table.operator}, {words}, {table.length} frames, "
            f"target {table.pair.target_id + 1}"
        )

    def grant(self, console: Console, wish: Wish) -> None:
        """Do what the page wishes.

        Raises:
            ConfigurationError: The viewer does not offer it, or the next episode is of another environment.
        """
        require(wish.kind in OFFERS, f"{wish.kind!r} has no meaning while a recording is shown")
        if wish.kind == "stop":
            console.pilot.rest()
        elif wish.kind == "again":
            self.show(console)
        elif wish.kind == "next":
            self._turn(console)
        else:
            if console.env.is_over or console.env.frame >= self.table.length:
                self.show(console)
            console.pilot.work()

    def _turn(self, console: Console) -> None:
        """Show the next episode, after the last one the first."""
        following = self._read((self.table.index + 1) % self._info.total_episodes)
        mine, others = ((table.spec.id, table.pair.scene_set, table.settings) for table in (self.table, following))
        require(
            mine == others,
            f"episode {following.index} was recorded in another environment ({others} in place of {mine}); "
            f"look at it with --episode={following.index}",
        )
        self.table, self.actor.action = following, following.action
        self.show(console)

    def _read(self, episode: int) -> EpisodeTable:
        (table,) = iterate_episodes(self._root, index_keys(self._info.spec), episodes=[episode])
        return table


@contextmanager
def open_viewer(
    root: Path, episode: int, *, access: Access, size: tuple[int, int], speed: float = 1.0
) -> Iterator[OpenConsole]:
    """Serve the page of a recorded episode while the block runs; see `open_console` for the other arguments.

    Raises:
        DatasetError: The dataset cannot be read.
        ConfigurationError: There is no such episode.
        DeviceError: The address is taken.
    """
    viewer = Viewer(root, episode)
    env, seat, feed = viewer.make_env(), DriversSeat(), Feed()
    pilot = Pilot(env, seat, env.task_spec.make_sticks(), policy=viewer.actor, policy_name="the recording")
    grant: Callable[[Console, Wish], None] = viewer.grant
    console = Console(
        env, seat, feed, pilot=pilot, recorder=Recorder(None), grant=grant, size=size, speed=speed, offers=OFFERS
    )
    try:
        with PageServer(access, feed, seat).running():
            viewer.show(console)
            console.show()
            yield OpenConsole(console=console, address=access.address)
    finally:
        console.close()
        env.close()
