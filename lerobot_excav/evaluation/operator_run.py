"""Evaluating the scripted operator, as lerobot-eval evaluates a policy: same scenes, same file."""

import json
from pathlib import Path
from typing import Any

from lerobot_excav.datasets.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.pair import Pair
from lerobot_excav.datasets.progress import EpisodeProgress
from lerobot_excav.datasets.rig import ExcavatorRig, Rig
from lerobot_excav.datasets.simulation import play_demonstration
from lerobot_excav.datasets.workers import episode_result, submit_episode, worker_pool
from lerobot_excav.errors import DatasetError


def evaluate_operator(
    settings: DemonstrationSettings,
    path: Path,
    *,
    workers: int = 2,
    rig: Rig | None = None,
    show_progress: bool = True,
) -> None:
    """Let the scripted operator play scenes without pictures, and write a metrics file.

    Args:
        settings: What to play.
        path: Metrics file; its folder is made. Lines appear in the order of the settings, as soon as they are known.
        workers: Worker processes; 0 works in this process.
        rig: Environment and operator; the excavator by default.
        show_progress: Whether to draw a progress bar.

    Raises:
        DatasetError: The file exists.
        ExcavError: An episode could not be played.
    """
    if path.exists():
        raise DatasetError(f"--metrics={path} exists; choose another file, or remove it first")
    path.parent.mkdir(parents=True, exist_ok=True)
    rig = rig or ExcavatorRig(with_images=False)
    pairs = settings.pairs()
    with (
        path.open("w") as file,
        worker_pool(workers) as pool,
        EpisodeProgress(len(pairs), show=show_progress) as progress,
    ):
        futures = {
            pair: submit_episode(pool, progress, play_for_metrics, rig, settings, pair) for pair in pairs
        }
        for number, (pair, future) in enumerate(futures.items()):
            line = {"episode_ix": number, **episode_result(pair, future)}
            file.write(json.dumps(line, allow_nan=False) + "\n")
            file.flush()


def play_for_metrics(rig: Rig, settings: DemonstrationSettings, pair: Pair) -> dict[str, Any]:
    """Play one episode and return its line of the metrics file; runs in a worker."""
    episode = play_demonstration(rig, settings, pair)
    return {
        "operator": "scripted",
        "operator_seed": settings.seed,
        "task": settings.task,
        "fps": settings.fps,
        "success": episode.success,
        **episode.metrics,
    }
