"""The settings agree with the simulation that they describe."""

import pytest

from lerobot_excav.envs.machines.excavator.worksite import TICK_S
from lerobot_excav.envs.soil import FIDELITIES, PRESETS
from lerobot_excav.envs.tasks import settings
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.errors import ConfigurationError


def test_repeated_values_are_those_of_the_simulation() -> None:
    assert set(settings.SOILS) == set(PRESETS)
    assert set(settings.FIDELITIES) == set(FIDELITIES)
    assert round(1.0 / TICK_S) == settings.TICKS_PER_SECOND


@pytest.mark.parametrize("size_px", settings.IMAGE_SIZE_LIMITS)
def test_the_environment_accepts_the_image_limits(size_px: int) -> None:
    ExcavatorEnv(observation_height=size_px, observation_width=size_px)


@pytest.mark.parametrize("size_px", [settings.IMAGE_SIZE_LIMITS[0] - 1, settings.IMAGE_SIZE_LIMITS[1] + 1])
def test_the_environment_refuses_other_images(size_px: int) -> None:
    with pytest.raises(ConfigurationError, match=f"observation_height={size_px}"):
        ExcavatorEnv(observation_height=size_px)
