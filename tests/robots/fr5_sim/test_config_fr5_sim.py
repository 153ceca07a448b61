"""What only `--robot.type=fr5_sim` accepts."""

import pytest

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig


@pytest.mark.parametrize("task", ["Dance-v0", "Scoop-v0"])
def test_a_task_of_another_machine_is_refused(task):
    with pytest.raises(ConfigurationError, match=rf"robot\.task='{task}'.*'FR5Grasp-v0'"):
        FR5SimConfig(task=task)
