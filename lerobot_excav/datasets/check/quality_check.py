"""Quality check of a dataset: schema, values, paired starts and replays; the verdict goes into the index."""

from collections import defaultdict
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from lerobot_excav.datasets.check.episode_check import MAIN_KEY, episode_problems, scene_problems
from lerobot_excav.datasets.check.replay_check import replay_problem
from lerobot_excav.datasets.format.episode_table import EpisodeTable, iterate_episodes, read_info
from lerobot_excav.datasets.format.schema import require_columns
from lerobot_excav.datasets.format.version_check import require_this_simulation, versions_of
from lerobot_excav.datasets.pairs.paired_index import FAILED, PASSED, build_index, index_keys, store_index
from lerobot_excav.errors import require


def check_dataset(
    root: Path, *, episodes: Collection[int] | None = None, replays: int = 3, seed: int = 0
) -> pd.DataFrame:
    """Check a dataset and note the verdicts in its index.

    Args:
        root: The dataset.
        episodes: Episodes to check; all by default.
        replays: How many of them to replay, chosen at random.
        seed: Seed of that choice.

    Returns:
        The checked rows of the index, with `qc` (`passed` or `failed`), `qc_problem` and `replayed`.

    Raises:
        DatasetError: A column is missing or contradictory, or replays are asked for of what another version of the
            simulation recorded.
        ConfigurationError: An episode that does not exist, or a negative number of replays.
    """
    info = read_info(root)
    spec = info.spec
    require_columns(spec, info.features)
    wanted = sorted(range(info.total_episodes) if episodes is None else set(episodes))
    unknown = [index for index in wanted if not 0 <= index < info.total_episodes]
    require(bool(wanted), "--episodes=[] names no episode; leave it out to check all")
    require(not unknown, f"--episodes names {unknown}; the dataset has episodes 0 to {info.total_episodes - 1}")
    require(replays >= 0, f"--replays={replays} must not be negative")

    index = build_index(root)
    problems = _static_problems(root, wanted, index_keys(spec))
    sound = [number for number in wanted if not problems[number]]
    sample = np.random.default_rng(seed).permutation(sound)[:replays].tolist()
    if sample:
        versions = versions_of(index)
        require_this_simulation(
            spec, {i: versions[i] for i in wanted}, source=root, instead="; --replays=0 checks all but replays"
        )
        for recorded in iterate_episodes(root, index_keys(spec), episodes=sample):
            problem = replay_problem(recorded, fps=info.fps)
            problems[recorded.index] = [problem] if problem else []

    checked = index["episode_index"].isin(wanted)
    texts = index["episode_index"].map(lambda number: "; ".join(problems.get(number, [])))
    index.loc[checked, "qc"] = np.where(texts[checked] == "", PASSED, FAILED)
    index.loc[checked, "qc_problem"] = texts[checked]
    store_index(root, index)
    return index[checked].assign(replayed=index["episode_index"].isin(sample))


def _static_problems(root: Path, wanted: list[int], keys: list[str]) -> dict[int, list[str]]:
    problems: dict[int, list[str]] = {}
    scenes: dict[tuple[Any, ...], list[EpisodeTable]] = defaultdict(list)
    for episode in iterate_episodes(root, (*keys, MAIN_KEY, "frame_index"), episodes=wanted):
        problems[episode.index] = episode_problems(episode)
        if not problems[episode.index]:
            start = (episode.simulation_version, episode.pair._replace(target_id=0), *_start(episode))
            scenes[start].append(episode.first_frame())
    for starts in scenes.values():
        for number, problem in scene_problems(starts).items():
            problems[number].append(problem)
    return problems


def _start(episode: EpisodeTable) -> list[str]:
    """Return the settings, besides the scene, that determine how an episode starts; fidelity does not."""
    return [value for name, value in episode.settings.items() if name in episode.spec.settings.start_columns()]
