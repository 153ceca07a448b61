"""The environments that demonstrations are recorded in and datasets come from."""

from lerobot_excav.datasets.record.environment import EnvironmentDescription
from lerobot_excav.datasets.record.excavator_environment import EXCAVATOR
from lerobot_excav.datasets.record.fr5_grasp_environment import FR5_GRASP
from lerobot_excav.errors import DatasetError, require_choice

ENVIRONMENTS = {description.name: description for description in (EXCAVATOR, FR5_GRASP)}
"""Descriptions by name."""


def environment_named(field: str, name: str) -> EnvironmentDescription:
    """Return the description of an environment.

    Args:
        field: What the user gave the name for.
        name: The name.

    Raises:
        ConfigurationError: There is none of this name.
    """
    require_choice(field, name, tuple(ENVIRONMENTS))
    return ENVIRONMENTS[name]


def environment_of_robot(robot_type: str | None) -> EnvironmentDescription:
    """Return the description of the environment that a dataset comes from.

    Args:
        robot_type: What the dataset's `meta/info.json` says.

    Raises:
        DatasetError: It comes from elsewhere.
    """
    for description in ENVIRONMENTS.values():
        if description.robot_type == robot_type:
            return description
    known = ", ".join(repr(description.robot_type) for description in ENVIRONMENTS.values())
    raise DatasetError(
        f"robot_type={robot_type!r} in meta/info.json is none of this package's simulations; allowed: {known}"
    )
