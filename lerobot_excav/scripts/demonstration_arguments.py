"""Arguments that describe demonstrations, shared by the commands that make the operator dig."""

import argparse
from typing import Any

from lerobot_excav.datasets.format.storage import STORAGES
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.environments import ENVIRONMENTS
from lerobot_excav.datasets.record.target_rule import TARGET_RULES
from lerobot_excav.envs.tasks.settings import FIDELITIES, SCENE_SETS, SOILS, TARGETS_PER_SCENE

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
        name = option.replace("-", "_")
        # What depends on the environment is filled in when that is known.
        value = None if name in _defaults_by_environment() else default[name]
        shown = _defaults_by_environment().get(name, value)
        group.add_argument(f"--{option}", default=value, help=f"{help_text} (default: {shown})", **options)

    add("env", "environment", choices=tuple(ENVIRONMENTS))
    add("task", "task of the environment")
    add("scene-set", "random stream of the scenes; train, val and test share none", choices=SCENE_SETS)
    add("first-scene", "number of the first scene", type=int)
    add("scenes", "how many scenes", type=int)
    add(
        "targets",
        "targets per scene; 4 pairs every scene with every target, 1 shows each scene once",
        type=int,
        choices=range(1, TARGETS_PER_SCENE + 1),
    )
    add(
        "target-rule",
        "with --targets=1: go round the targets from scene to scene, draw them, or take the nearest one",
        choices=TARGET_RULES,
    )
    add("seed", "seed of the operator's variations and of drawn targets", type=int)
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


def add_storage(parser: argparse.ArgumentParser) -> None:
    """Add the option that says how pictures are stored."""
    shown = _defaults_by_environment()["storage"]
    parser.add_argument(
        "--storage",
        choices=STORAGES,
        help=f"pictures as PNG, or as lossless video, which long action chunks need (default: {shown})",
    )


def settings_from(arguments: argparse.Namespace) -> DemonstrationSettings:
    """Make settings of parsed arguments; fields without an option keep the default of the environment.

    Raises:
        ConfigurationError: A field has a value that is not possible in this environment.
    """
    given = {
        name: getattr(arguments, name)
        for name in DemonstrationSettings().as_dict()
        if getattr(arguments, name, None) is not None
    }
    return DemonstrationSettings.of(given.pop("env"), **given)


def _defaults_by_environment() -> dict[str, str]:
    """Describe defaults that depend on the environment: `10 for excavator, 50 for fr5_grasp`."""
    texts: dict[str, list[str]] = {}
    for env, description in ENVIRONMENTS.items():
        for name, value in description.defaults.items():
            texts.setdefault(name, []).append(f"{value} for {env}")
    return {name: ", ".join(parts) for name, parts in texts.items()}
