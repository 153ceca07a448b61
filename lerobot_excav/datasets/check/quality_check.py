"""Quality check of a dataset: can it be read, are its columns as declared, pictures, facts, replays."""

from collections import defaultdict
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from lerobot_excav.datasets.check.episode_check import (
    action_problems,
    fact_problems,
    mask_problems,
    scene_problems,
)
from lerobot_excav.datasets.check.numbering_check import numbering_problems
from lerobot_excav.datasets.check.picture_check import picture_problems
from lerobot_excav.datasets.check.quality_report import Findings, QualityReport
from lerobot_excav.datasets.check.readability import check_opening, layout_problems
from lerobot_excav.datasets.check.replay_check import replay_problem
from lerobot_excav.datasets.check.statistics_check import VECTOR_KEYS, SeenValues, statistics_problems
from lerobot_excav.datasets.check.testbed_check import check_testbed_recording, is_testbed_recording
from lerobot_excav.datasets.format.dataset_info import DatasetInfo, read_info
from lerobot_excav.datasets.format.episode_table import EpisodeTable, episode_table, iterate_episodes
from lerobot_excav.datasets.format.frame_files import EpisodeRows, iterate_rows
from lerobot_excav.datasets.format.metadata import (
    EpisodeMetadata,
    Statistics,
    read_episode_metadata,
    read_statistics,
    read_tasks,
)
from lerobot_excav.datasets.format.schema import PAIR_KEY, require_columns, require_numbering
from lerobot_excav.datasets.format.version_check import require_this_simulation
from lerobot_excav.datasets.pairs.paired_index import build_index, index_keys, store_index
from lerobot_excav.errors import DatasetError, ExcavError, require

UNREADABLE = "has no frames that can be read"
SHOW_AFTER_S = 2.0  # a bar for less would only flicker


@dataclass(frozen=True, kw_only=True)
class _Dataset:
    """A dataset, and what can be read of its metadata."""

    root: Path
    info: DatasetInfo
    metadata: list[EpisodeMetadata] | None
    tasks: list[str] | None
    statistics: Statistics | None


def check_dataset(
    root: Path,
    *,
    episodes: Collection[int] | None = None,
    replays: int = 3,
    seed: int = 0,
    show_progress: bool = False,
) -> QualityReport:
    """Check a dataset. Damage is a problem of the report, not an error.

    A recording of a real machine has no scene, so it is neither replayed nor compared with its pairs; its ages are.

    Args:
        root: The dataset.
        episodes: Episodes to check; all by default.
        replays: How many of them to replay, chosen at random.
        seed: Seed of that choice.
        show_progress: Whether to draw a bar if it takes long.

    Raises:
        DatasetError: There is no folder.
        ConfigurationError: An episode that does not exist, or a negative number of replays.
    """
    require(replays >= 0, f"--replays={replays} must not be negative")
    require(episodes is None or bool(episodes), "--episodes=[] names no episode; leave it out to check all")
    if not root.is_dir():
        raise DatasetError(f"{root} is not a folder; give the folder of a dataset")
    findings = Findings()
    info = findings.attempt(read_info, root)
    if info is None:
        return findings.report()
    _require_known(episodes, info)
    dataset = _Dataset(
        root=root,
        info=info,
        metadata=findings.attempt(read_episode_metadata, root, info),
        tasks=findings.attempt(read_tasks, root, info),
        statistics=findings.attempt(read_statistics, root),
    )
    if is_testbed_recording(info):
        check_testbed_recording(root, info, dataset.metadata or [], findings, episodes)
        return findings.report(has_pairs=False)
    if findings.attempt(_require_columns, info):
        _check_contents(dataset, findings, episodes, show_progress=show_progress)
        _check_replays(dataset, findings, replays, seed, show_progress=show_progress)
    return findings.report()


def note_verdicts(root: Path, report: QualityReport) -> None:
    """Note the verdicts of a check in the index of a dataset, so that episodes that failed are not chosen.

    Raises:
        DatasetError: There can be no index, as a column is missing, damaged or contradictory.
        OSError: It cannot be written.
    """
    index = build_index(root)
    checked = report.episodes.set_index("episode_index")
    known = index["episode_index"].isin(checked.index)
    for column in ("qc", "qc_problem"):
        index.loc[known, column] = index.loc[known, "episode_index"].map(checked[column])
    store_index(root, index)


def _require_known(episodes: Collection[int] | None, info: DatasetInfo) -> None:
    unknown = [index for index in sorted(set(episodes or ())) if not 0 <= index < info.total_episodes]
    require(not unknown, f"--episodes names {unknown}; the dataset has episodes 0 to {info.total_episodes - 1}")


def _require_columns(info: DatasetInfo) -> bool:
    require_columns(info.spec, info.features)
    require_numbering(info.features)
    return True


def _check_contents(
    dataset: _Dataset, findings: Findings, episodes: Collection[int] | None, *, show_progress: bool
) -> None:
    root, info = dataset.root, dataset.info
    findings.dataset += findings.attempt(lambda: list(layout_problems(root, info, dataset.metadata or []))) or []
    stored = [key for key in info.features if key not in info.keys_of("video")]
    rows = iterate_rows(root, info, stored, episodes=episodes, report=findings.note)
    total = info.total_episodes if episodes is None else len(set(episodes))
    scenes: dict[tuple[Any, ...], list[EpisodeTable]] = defaultdict(list)
    seen = SeenValues()
    for found in _with_bar(rows, total, "episodes", show=show_progress):
        episode = _check_episode(dataset, found, findings)
        if episode is not None:
            for key in VECTOR_KEYS:
                seen.add(key, episode.array(key))
            if not findings.episodes[found.index]:
                scenes[_start(episode)].append(episode.first_frame())
    for index in range(len(dataset.metadata or ())) if episodes is None else episodes:
        findings.episodes.setdefault(index, [UNREADABLE])
    for starts in scenes.values():
        for number, problem in scene_problems(starts).items():
            findings.episodes[number].append(problem)
    if dataset.statistics is not None:
        is_whole = len(findings.lengths) == info.total_episodes
        findings.dataset += statistics_problems(dataset.statistics, info, seen if is_whole else None)
    check_opening(root, info, findings)


def _check_episode(dataset: _Dataset, rows: EpisodeRows, findings: Findings) -> EpisodeTable | None:
    """Judge one episode, and return it if its columns can be read; what a check needs is judged before it."""
    info = dataset.info
    problems = findings.episodes[rows.index] = list(rows.problems)
    if problems:
        return None
    metadata = None if dataset.metadata is None else dataset.metadata[rows.index]
    problems += numbering_problems(rows, fps=info.fps, metadata=metadata, tasks=dataset.tasks)
    if metadata is None and info.keys_of("video"):
        problems.append("its videos cannot be found without meta/episodes")
        return None
    episode = episode_table(dataset.root, info, rows, metadata, list(info.features))
    findings.uids[rows.index] = str(rows.table[PAIR_KEY][0].as_py())
    findings.lengths[rows.index] = episode.length
    problems += [*fact_problems(episode), *action_problems(episode)]
    damaged = list(picture_problems(episode))
    problems += damaged or mask_problems(episode)
    if not problems:
        findings.versions[rows.index] = episode.simulation_version
    return episode


def _check_replays(dataset: _Dataset, findings: Findings, replays: int, seed: int, *, show_progress: bool) -> None:
    sample = np.random.default_rng(seed).permutation(findings.sound())[:replays].tolist()
    if not sample:
        return
    info, instead = dataset.info, "; --replays=0 checks all but replays"
    try:
        require_this_simulation(info.spec, findings.versions, source=dataset.root, instead=instead)
    except DatasetError as another_version:
        findings.note(another_version)
        return
    # What cannot be read was told of before.
    recorded = iterate_episodes(dataset.root, index_keys(info.spec), episodes=sample, report=lambda _: None)
    for episode in _with_bar(recorded, len(sample), "replays", show=show_progress):
        findings.replayed.append(episode.index)
        try:
            problem = replay_problem(episode, fps=info.fps)
        except ExcavError as error:
            problem = f"cannot be replayed: {error}"
        findings.episodes[episode.index] += [problem] if problem else []


def _with_bar[Item](items: Iterable[Item], total: int, what: str, *, show: bool) -> Iterable[Item]:
    bar: Iterable[Item] = tqdm(items, total=total, desc=what, disable=not show, delay=SHOW_AFTER_S, leave=False)
    return bar


def _start(episode: EpisodeTable) -> tuple[Any, ...]:
    """Return what determines how an episode starts: scene, version, and settings, though fidelity does not."""
    settings = [value for name, value in episode.settings.items() if name in episode.spec.settings.start_columns()]
    return (episode.simulation_version, episode.pair._replace(target_id=0), *settings)
