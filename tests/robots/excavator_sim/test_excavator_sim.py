"""What only the simulated excavator does; what it shares with other robots is in tests/contract."""

import pytest

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim


def test_features_name_the_four_joints(tmp_path):
    robot = ExcavatorSim(ExcavatorSimConfig(calibration_dir=tmp_path))
    assert list(robot.observation_features) == [
        *("swing.pos", "boom.pos", "arm.pos", "bucket.pos"),
        *("swing.vel", "boom.vel", "arm.vel", "bucket.vel"),
        *("main", "cab", "target_mask"),
    ]
    assert list(robot.action_features) == ["swing.vel", "boom.vel", "arm.vel", "bucket.vel"]


def test_settings_reach_the_environment(tmp_path):
    settings = {"fps": 25, "soil": "gravel", "fidelity": "fine", "scene_set": "val", "observation_height": 64}
    env = ExcavatorSim(ExcavatorSimConfig(calibration_dir=tmp_path, **settings)).make_env()
    assert {name: getattr(env.settings, name) for name in settings} == settings
    assert env.episode_length > 10**9


@pytest.mark.parametrize(("field", "value", "allowed"), [("soil", "lava", "sand"), ("fidelity", "exact", "fine")])
def test_an_impossible_value_is_named_with_what_is_allowed(field, value, allowed):
    with pytest.raises(ConfigurationError, match=f"robot.{field}={value!r}.*{allowed}"):
        ExcavatorSimConfig(**{field: value})
