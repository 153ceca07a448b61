"""Arguments that describe demonstrations, shared by the commands that make the operator dig."""

import argparse
from typing import Any

from lerobot_excav.datasets.demonstration_settings import ENVS, DemonstrationSettings
from lerobot_excav.envs.settings import FIDELITIES, SCENE_SETS, SOILS, TARGETS_PER_SCENE

DEFAULT_WORKERS = 2


def add_settings(parser: argparse.ArgumentParser, **defaults: Any) -> None:
    """Add an option per field of `DemonstrationSettings`, except those that only datasets have.

    Args:
        parser: Where to add them.
        defaults: Fields whose default differs from that of `DemonstrationSettings`.
    """
    default = {**DemonstrationSettings().as_dict(), **defaults}
    group = parser.add_argument_group("what is played")

    def add(option: str, help_text: str, **options: Any) -> None:
        value = default[option.replace("-", "_")]
        group.add_argument(f"--{option}", default=value, help=f"{help_text} (default: {value})", **options)

    add("env", "environment", choices=ENVS)
    add("task", "task of the environment")
    add("scene-set", "random stream of the scenes; train, val and test share none", choices=SCENE_SETS)
    add("first-scene", "number of the first scene", type=int)
    add("scenes", "how many scenes", type=int)
    add(
        "targets",
        "targets per scene; 4 pairs every scene with every target, 1 shows each scene once and goes round the targets",
        type=int,
        choices=range(1, TARGETS_PER_SCENE + 1),
    )
    add("seed", "seed of the operator's variations", type=int)
    add("fps", "frames per second", type=int)
    add("soil", "soil preset", choices=SOILS)
    add("fidelity", "numerical effort of the soil", choices=FIDELITIES)
    add("episode-length", "time limit [frames]", type=int)
    group.add_argument(
        "--workers",
        type=int,
        default=DEFAULT_WORKERS,
        help=f"processes that simulate; the result does not depend on it (default: {DEFAULT_WORKERS})",
    )


def settings_from(arguments: argparse.Namespace) -> DemonstrationSettings:
    """Make settings of parsed arguments; fields without an option keep their default."""
    fields = DemonstrationSettings().as_dict()
    return DemonstrationSettings(
        **{name: getattr(arguments, name) for name in fields if hasattr(arguments, name)}
    )
