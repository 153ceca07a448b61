"""Refusing to replay what another version of the simulation recorded, and to mix versions."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DatasetError


def require_this_simulation(spec: TaskSpec, versions: Mapping[int, int], *, source: Path, instead: str) -> None:
    """Check that episodes can be replayed by this version of the simulation.

    Args:
        spec: Task of the robot that they were recorded with.
        versions: Version of the simulation by episode index.
        source: The dataset.
        instead: What can be done without a replay, for the message.

    Raises:
        DatasetError: An episode is of another version.
    """
    current = spec.simulation_version
    for version, episodes in episodes_by_version(versions).items():
        if version != current:
            newer = max(version, current)
            changes = spec.changes.get(newer, "unknown to this older package")
            raise DatasetError(
                f"{source}: {describe_episodes(episodes)} of version {version} of the simulation cannot be replayed "
                f"in version {current}, which this is (version {newer}: {changes}). Record again, or "
                f"install the release of lerobot_env_excav that recorded them{instead}"
            )


def require_one_version(versions: Mapping[int, int], *, source: Path) -> None:
    """Check that episodes come from one version of the simulation, so that a scene's number means one scene.

    Raises:
        DatasetError: They come from several.
    """
    groups = episodes_by_version(versions)
    if len(groups) > 1:
        found = "; ".join(f"version {v}: {describe_episodes(e)}" for v, e in groups.items())
        raise DatasetError(
            f"{source} mixes versions of the simulation ({found}). A scene's number means another scene in each, so "
            "pairs cannot be told; take the versions apart with `lerobot-edit-dataset --operation.type=split`"
        )


def versions_of(index: pd.DataFrame) -> dict[int, int]:
    """Return the version of the simulation by episode index, from a paired-scene index."""
    return dict(zip(index["episode_index"].tolist(), index["simulation_version"].tolist(), strict=True))


def episodes_by_version(versions: Mapping[int, int]) -> dict[int, list[int]]:
    """Group episode indices by version, both in order."""
    return {v: [index for index in sorted(versions) if versions[index] == v] for v in sorted(set(versions.values()))}


def describe_episodes(episodes: list[int]) -> str:
    """Name a few episodes: `episodes 0, 1, 2 and 16 more`."""
    names = ", ".join(map(str, episodes[:3]))
    return f"episodes {names} and {len(episodes) - 3} more" if len(episodes) > 3 else f"episodes {names}"
