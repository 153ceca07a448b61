"""A recorded episode is shown as it was."""

import numpy as np
import pytest

from lerobot_excav.console.console import Console
from lerobot_excav.console.pilot import Pilot
from lerobot_excav.console.recorder import Recorder
from lerobot_excav.console.viewing import OFFERS, Viewer
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.page.drivers_seat import DriversSeat
from lerobot_excav.page.feed import Feed

from .conftest import Driver

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    root = tmp_path_factory.mktemp("demos") / "scripted"
    settings = DemonstrationSettings.of("excavator", {"fidelity": "fast"}, scenes=1, targets=2)
    record_demonstrations(settings, root, workers=0, show_progress=False)
    return root


@pytest.fixture
def viewed(dataset):
    viewer = Viewer(dataset, 1)
    env, seat = viewer.make_env(), DriversSeat()
    pilot = Pilot(env, seat, env.task_spec.make_sticks(), policy=viewer.actor, policy_name="the recording")
    console = Console(
        env, seat, Feed(), pilot=pilot, recorder=Recorder(None), grant=viewer.grant, size=(96, 128), offers=OFFERS
    )
    viewer.show(console)
    yield viewer, Driver(console)
    console.close()
    env.close()


def test_the_recorded_states_come_again_and_then_time_stands_still(viewed):
    viewer, driver = viewed
    table = viewer.table
    assert "episode 1 of 2: scripted, success" in driver.state["words"]
    assert driver.state["offers"] == ["work", "stop", "again", "next"]
    driver.wish("work")
    for frame in range(driver.console.env.frame, table.length):
        np.testing.assert_allclose(driver.console.env.agent_pos, table.state[frame], atol=1e-5)
        assert driver.state["target"] == table.target_id[frame]
        assert driver.tick() == 1
    assert driver.tick(times=3) == 0
    assert driver.state["mode"] == "still"
    driver.wish("work")  # once more, from the start
    assert driver.state["frame"] == 1


def test_it_is_paused_and_begun_again_and_the_next_episode_follows_the_last_one_round(viewed):
    viewer, driver = viewed
    driver.wish("work")
    driver.tick(times=3)
    driver.wish("stop")
    assert driver.tick(times=3) == 0
    assert driver.state["frame"] == 4
    driver.wish("again")
    assert driver.state["frame"] == 0
    driver.wish("next")
    assert viewer.table.index == 0
    assert driver.state["target"] == 0
    driver.wish("work")
    assert driver.tick(times=3) == 3
    driver.wish("point", x=0.5, y=0.5)
    assert "has no meaning" in driver.state["words"]


def test_what_is_not_there_is_refused(dataset, tmp_path):
    with pytest.raises(ConfigurationError, match=r"--episode=2 does not exist; .* has 2"):
        Viewer(dataset, 2)
    with pytest.raises(DatasetError):
        Viewer(tmp_path, 0)
