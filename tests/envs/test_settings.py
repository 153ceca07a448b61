"""The settings repeated outside the simulator equal those inside it."""

import pytest

from lerobot_excav.envs import settings
from lerobot_excav.envs.excavator.env import ExcavatorEnv
from lerobot_excav.envs.excavator.mask_condition import MASK_CONDITIONS
from lerobot_excav.envs.excavator.scene import SCENE_SETS
from lerobot_excav.envs.excavator.targets import TARGET_COUNT
from lerobot_excav.envs.excavator.worksite import TICK_S
from lerobot_excav.envs.soil import PRESETS
from lerobot_excav.errors import ConfigurationError


def test_choices_are_those_of_the_simulation() -> None:
    assert settings.SCENE_SETS == SCENE_SETS
    assert settings.MASK_CONDITIONS == MASK_CONDITIONS
    assert set(settings.SOILS) == set(PRESETS)
    assert settings.TARGETS_PER_SCENE == TARGET_COUNT
    assert round(1.0 / TICK_S) == settings.TICKS_PER_SECOND


@pytest.mark.parametrize("size_px", settings.IMAGE_SIZE_LIMITS)
def test_the_environment_accepts_the_image_limits(size_px: int) -> None:
    ExcavatorEnv(observation_height=size_px, observation_width=size_px)


@pytest.mark.parametrize("size_px", [settings.IMAGE_SIZE_LIMITS[0] - 1, settings.IMAGE_SIZE_LIMITS[1] + 1])
def test_the_environment_refuses_what_the_settings_refuse(size_px: int) -> None:
    with pytest.raises(ConfigurationError):
        settings.require_image_size("size", size_px)
    with pytest.raises(ConfigurationError):
        ExcavatorEnv(observation_height=size_px)
