"""Evaluating the scripted operator, as lerobot-eval evaluates a policy: same scenes, same file."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.record.demonstration_settings import PlayedScenes
from lerobot_excav.datasets.record.progress import EpisodeProgress
from lerobot_excav.datasets.record.simulation import play_demonstration
from lerobot_excav.datasets.record.workers import episode_results, submit_episodes, worker_pool
from lerobot_excav.envs.configs.metrics_log import json_line
from lerobot_excav.envs.configs.provenance import write_provenance
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.errors import ConfigurationError, DatasetError, ExcavError
from lerobot_excav.run_lock import RunLock
from lerobot_excav.whole_file import named, write_whole


def evaluate_operator(
    settings: PlayedScenes, path: Path, *, workers: int = 2, resume: bool = False, show_progress: bool = True
) -> None:
    """Let the scripted operator play scenes without pictures, and write a metrics file.

    Until it is complete the file is called `PATH.partial`; its lines are in the order of the settings.

    Raises:
        DatasetError: The file exists, an interrupted run is in the way, something else lies in its place, or another
            process is at it.
        ConfigurationError: The interrupted run has other settings.
        ExcavError: An episode could not be played.
    """
    _require_free(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.name}.partial")
    lock = RunLock(path.with_name(f".{path.name}.lock"), partial)
    try:
        if partial.exists() and not resume:
            raise DatasetError(f"{partial} is an interrupted run; continue it with --resume=true, or remove the file")
        pairs = settings.pairs()
        lines = _finished_lines(partial, settings, pairs)
        # Rewritten whole, so that a line torn by the interruption is gone.
        write_whole(partial, "".join(lines))
        _play_rest(settings, partial, pairs, len(lines), workers, show=show_progress)
        _require_free(path)
        partial.rename(path)
    finally:
        lock.release()
    write_provenance(path)


def _require_free(path: Path) -> None:
    if path.exists():
        raise DatasetError(f"--metrics={path} exists; choose another file, or remove it first")


def _play_rest(
    settings: PlayedScenes, partial: Path, pairs: list[Pair], first: int, workers: int, *, show: bool
) -> None:
    """Play the pairs from `first` on and append their lines."""
    with (
        _append_to(partial) as append,
        worker_pool(workers) as pool,
        EpisodeProgress(len(pairs), show=show) as progress,
    ):
        for _ in range(first):
            progress.skip()
        futures = [submit_episodes(pool, progress, play_for_metrics, settings, pair) for pair in pairs[first:]]
        for number, future in enumerate(futures, first):
            (played,) = episode_results(future)
            append(json_line({"episode_ix": number, **played["line"]}))


@contextmanager
def _append_to(path: Path) -> Iterator[Callable[[str], None]]:
    """Provide a function that appends text at once; its errors name the file."""
    with path.open("a", encoding="utf-8") as file:

        def append(text: str) -> None:
            try:
                file.write(text)
                file.flush()
            except OSError as error:
                raise named(error, path) from error

        yield append


def play_for_metrics(settings: PlayedScenes, pair: Pair) -> list[dict[str, Any]]:
    """Play one episode and return its `success` and its `line` of the metrics file, in a list; runs in a worker.

    Raises:
        ExcavError: It could not be played; the message names it.
    """
    try:
        episode = play_demonstration(settings, pair, with_images=False)
    except ExcavError as error:
        raise ExcavError(f"{pair.uid}: {error}") from error
    return [{"success": episode.success, "line": {**_operator(settings), **episode.metrics}}]


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
        "stage": pair.stage,
        "target_id": pair.target_id,
        "episode_length": settings.episode_length,
    }


def _finished_lines(partial: Path, settings: PlayedScenes, pairs: list[Pair]) -> list[str]:
    """Return the whole lines of an interrupted run, after checking that all that lies there is of these settings."""
    if not partial.exists():
        return []
    *whole, torn = partial.read_text(encoding="utf-8", errors="replace").split("\n")
    if len(whole) > len(pairs):
        raise ConfigurationError(
            f"{partial} holds {len(whole)} episodes, and {len(pairs)} are asked for; "
            "continue it with the same options, or remove the file"
        )
    for line, pair in zip(whole, pairs, strict=False):
        _require_line(line, partial, _expected(settings, pair), earlier=type(settings.env))
    head = json_line({"episode_ix": len(whole), **_operator(settings)}).rstrip("}\n")
    if not (torn.startswith(head) or head.startswith(torn)):
        raise _not_ours(partial)
    return [f"{line}\n" for line in whole]


def _require_line(line: str, partial: Path, expected: dict[str, Any], *, earlier: type[TaskSettings]) -> None:
    """Check a line; a setting that it lacks had not been there yet, so it was at its default."""
    try:
        record = json.loads(line)
    except ValueError as error:
        raise _not_ours(partial) from error
    if not isinstance(record, dict) or "operator_seed" not in record:
        raise _not_ours(partial)
    for name, value in expected.items():
        if record.get(name, getattr(earlier, name, None)) != value:
            raise ConfigurationError(
                f"{partial} was started with {name}={record.get(name)!r}, not {value!r}; "
                "continue it with the same options, or remove the file"
            )


def _not_ours(partial: Path) -> DatasetError:
    return DatasetError(
        f"{partial} holds something else than the lines of `lerobot-excav operator`; move it elsewhere, "
        "or choose another --metrics"
    )
