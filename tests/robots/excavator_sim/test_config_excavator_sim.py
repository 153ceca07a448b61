"""What only `--robot.type=excavator_sim` accepts."""

import pytest

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [("task", "Dance-v0", "'Scoop-v0'"), ("soil", "lava", "'sand'"), ("fidelity", "exact", "'fine'")],
)
def test_an_impossible_value_is_named_with_what_is_allowed(field: str, value: object, allowed: str) -> None:
    with pytest.raises(ConfigurationError) as raised:
        ExcavatorSimConfig(**{field: value})
    assert f"robot.{field}={value!r}" in str(raised.value)
    assert allowed in str(raised.value)
