"""Evaluating the scripted operator, as lerobot-eval evaluates a policy: same scenes, same file."""

import json
from pathlib import Path
from typing import Any

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.record.demonstration_settings import PlayedScenes
from lerobot_excav.datasets.record.progress import EpisodeProgress
from lerobot_excav.datasets.record.simulation import play_demonstration
from lerobot_excav.datasets.record.workers import episode_result, submit_episode, worker_pool
from lerobot_excav.envs.configs.metrics_log import json_line
from lerobot_excav.envs.configs.provenance import write_provenance
from lerobot_excav.errors import ConfigurationError, DatasetError


def evaluate_operator(
    settings: PlayedScenes, path: Path, *, workers: int = 2, resume: bool = False, show_progress: bool = True
) -> None:
    """Let the scripted operator play scenes without pictures, and write a metrics file.

    Until it is complete the file is called `PATH.partial`; its lines are in the order of the settings.

    Raises:
        DatasetError: The file exists, or an interrupted run is in the way.
        ConfigurationError: The interrupted run has other settings.
        ExcavError: An episode could not be played.
    """
    if path.exists():
        raise DatasetError(f"--metrics={path} exists; choose another file, or remove it first")
    partial = path.with_name(f"{path.name}.partial")
    if partial.exists() and not resume:
        raise DatasetError(f"{partial} is an interrupted run; continue it with --resume=true, or remove the file")
    path.parent.mkdir(parents=True, exist_ok=True)
    pairs = settings.pairs()
    lines = _finished_lines(partial, settings, pairs)
    # Rewritten whole, so that a line torn by the interruption is gone.
    partial.write_text("".join(f"{line}\n" for line in lines))
    _play_rest(settings, partial, pairs, len(lines), workers, show=show_progress)
    partial.rename(path)
    write_provenance(path)


def _play_rest(
    settings: PlayedScenes, partial: Path, pairs: list[Pair], first: int, workers: int, *, show: bool
) -> None:
    """Play the pairs from `first` on and append their lines."""
    with partial.open("a") as file, worker_pool(workers) as pool, EpisodeProgress(len(pairs), show=show) as progress:
        for _ in range(first):
            progress.skip()
        futures = [submit_episode(pool, progress, play_for_metrics, settings, pair) for pair in pairs[first:]]
        for number, future in enumerate(futures, first):
            file.write(json_line({"episode_ix": number, **episode_result(pairs[number], future)["line"]}))
            file.flush()


def play_for_metrics(settings: PlayedScenes, pair: Pair) -> dict[str, Any]:
    """Play one episode and return its `success` and its `line` of the metrics file; runs in a worker."""
    episode = play_demonstration(settings, pair, with_images=False)
    return {"success": episode.success, "line": {**_operator(settings), **episode.metrics}}


def _operator(settings: PlayedScenes) -> dict[str, Any]:
    """Return what the environment does not know: who plays."""
    return {"operator": "scripted", "operator_seed": settings.seed}


def _expected(settings: PlayedScenes, pair: Pair) -> dict[str, Any]:
    """Return the part of an episode's line that is known before it is played."""
    env = {name: value for name, value in settings.env.as_dict().items() if value is not None}
    return {
        **_operator(settings),
        "simulation_version": settings.task_spec.simulation_version,
        **env,
        "scene_id": pair.scene_id,
        "target_id": pair.target_id,
        "episode_length": settings.episode_length,
    }


def _finished_lines(partial: Path, settings: PlayedScenes, pairs: list[Pair]) -> list[str]:
    """Return the whole lines of an interrupted run, after checking that they belong to these settings."""
    if not partial.exists():
        return []
    lines = [line for line in partial.read_text().splitlines(keepends=True) if line.endswith("\n")]
    for line, pair in zip(lines, pairs, strict=False):
        record = json.loads(line)
        for name, value in _expected(settings, pair).items():
            if record.get(name) != value:
                raise ConfigurationError(
                    f"{partial} was started with {name}={record.get(name)!r}, not {value!r}; "
                    "continue it with the same options, or remove the file"
                )
    return [line.rstrip("\n") for line in lines[: len(pairs)]]
