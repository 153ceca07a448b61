"""A robot whose mask comes from a source that looks, in place of what the simulator knows."""

import numpy as np
import pytest
from lerobot.robots import make_robot_from_config

from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig

MACHINES = {"excavator": (ExcavatorSimConfig, {"fidelity": "fast"}), "fr5": (FR5SimConfig, {})}
PLACE = {"scene_set": "val", "scene_id": 3, "target_id": 1}


def first_mask(tmp_path, machine, **settings):
    config, own = MACHINES[machine]
    robot = make_robot_from_config(config(calibration_dir=tmp_path, **own, **PLACE, **settings))
    robot.connect()
    mask = robot.get_observation()["target_mask"]
    robot.disconnect()
    return mask[..., 0] > 0


@pytest.mark.parametrize("source", ["geometry", "click"])
@pytest.mark.parametrize("machine", MACHINES)
def test_depth_and_pixels_show_what_the_simulator_knows(tmp_path, machine, source):
    known, seen = first_mask(tmp_path, machine), first_mask(tmp_path, machine, mask_source=source)
    assert seen.any()
    assert (known & seen).sum() > 0.5 * (known | seen).sum()


def test_a_robot_shows_what_a_person_has_drawn(tmp_path):
    path = tmp_path / "drawn.toml"
    path.write_text('[[mask]]\nkey = "*"\npolygon = [[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]]\n')
    drawn = first_mask(tmp_path, "fr5", mask_source="manual", mask_options=str(path))
    expected = np.zeros((96, 128), bool)
    expected[24:72, 32:96] = True
    assert np.array_equal(drawn, expected)
