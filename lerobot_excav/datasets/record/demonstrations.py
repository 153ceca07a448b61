"""Recording scripted demonstrations: simulate in parallel, assemble in order, publish at once.

While it is being made, a dataset `OUT` is a folder `OUT.partial` with the settings, the finished episodes and the
LeRobot dataset that grows from them. The finished dataset is renamed to `OUT`, so `OUT` is complete or absent. Episodes
are assembled in the order of the settings, so neither the number of workers nor an interruption leaves a trace.
"""

import errno
import time
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from PIL import UnidentifiedImageError

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.pairs.paired_index import write_index
from lerobot_excav.datasets.record.changes_of_mind import require_approach
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.episode_store import EpisodeStore, Outcome
from lerobot_excav.datasets.record.partial_run import PartialRun
from lerobot_excav.datasets.record.progress import EpisodeProgress
from lerobot_excav.datasets.record.provenance import read_provenance, write_provenance
from lerobot_excav.datasets.record.simulation import simulate_episodes, simulate_scene
from lerobot_excav.datasets.record.workers import episode_results, require_workers, submit_episodes, worker_pool
from lerobot_excav.errors import DatasetError
from lerobot_excav.whole_file import named


@dataclass(frozen=True, kw_only=True)
class DemonstrationSummary:
    """What a run has made.

    Attributes:
        out: The dataset.
        episodes: Episodes in the dataset.
        failures: `pair_uid` of every episode without success.
        absent: `pair_uid` of every target that its start does not offer.
        waited: `pair_uid` of every episode that is left out because the machine waited for its mask.
        simulated_s: Simulated time of all episodes, kept or not [s].
        wall_s: Time that this call took [s].
    """

    out: Path
    episodes: int
    failures: list[str]
    absent: list[str]
    waited: list[str]
    simulated_s: float
    wall_s: float


def record_demonstrations(
    settings: DemonstrationSettings, out: Path, *, workers: int = 2, resume: bool = False, show_progress: bool = True
) -> DemonstrationSummary:
    """Record scripted demonstrations as a LeRobot dataset.

    Args:
        settings: What to record.
        out: Folder of the dataset.
        workers: Worker processes; 0 works in this process.
        resume: Whether to continue an interrupted run.
        show_progress: Whether to draw a progress bar.

    Returns:
        Counts, failures and times.

    Raises:
        DatasetError: `out` exists, an interrupted run is in the way, or no episode is worth keeping.
        ConfigurationError: `workers` is negative, a started run has other settings, or the source of masks chooses
            targets itself.
    """
    require_workers(workers)
    settings.env.require_commanded_mask()
    if settings.retarget:
        require_approach(settings.task_spec)
    start = time.monotonic()
    if out.exists() or out.is_symlink():  # a folder cannot take the place of a link that leads nowhere
        outcomes = _require_finished(out, settings, resume=resume)
        PartialRun.clear_finished(out, settings)
    else:
        with PartialRun(out, settings, resume=resume) as partial:
            outcomes = _fill(partial, settings, workers=workers, show_progress=show_progress)
            partial.dataset.rename(out)
            partial.clear()
    return DemonstrationSummary(
        out=out,
        episodes=sum(outcome["kept"] for outcome in outcomes),
        failures=[o["pair_uid"] for o in outcomes if not (o["success"] or o["mask_missing_frames"] or _is_absent(o))],
        absent=[o["pair_uid"] for o in outcomes if _is_absent(o)],
        waited=[o["pair_uid"] for o in outcomes if o["mask_missing_frames"]],
        simulated_s=sum(o["metrics"].get("frames", o["frames"]) for o in outcomes) / settings.env.fps,
        wall_s=time.monotonic() - start,
    )


def _require_finished(out: Path, settings: DemonstrationSettings, *, resume: bool) -> list[Outcome]:
    if not resume:
        raise DatasetError(f"--out={out} exists; choose another folder, or remove it first")
    provenance = read_provenance(out)
    settings.require_same(provenance.settings)
    return provenance.outcomes


def _fill(partial: PartialRun, settings: DemonstrationSettings, *, workers: int, show_progress: bool) -> list[Outcome]:
    """Simulate what is missing and assemble everything in order."""
    with (
        worker_pool(workers) as pool,
        EpisodeProgress(settings.episode_count, show=show_progress) as progress,
        ExitStack() as stack,
    ):
        futures = _start(pool, progress, settings, partial.episodes)
        # LeRobot takes seconds to load; by now the workers are at work.
        from lerobot_excav.datasets.record.assembly import append_episode, close_dataset, create_dataset

        dataset = create_dataset(partial.dataset, settings)
        # Else its threads go on writing into a folder that is given up.
        stack.callback(dataset.writer.stop_image_writer)
        outcomes = []
        for outcome in chain.from_iterable(map(episode_results, futures)):
            if outcome["kept"]:
                episode = EpisodeStore(partial.episodes).read(Pair.parse(outcome["pair_uid"]))
                with _errors_name(partial.dataset):
                    append_episode(dataset, episode, settings)
                progress.count_written()
            outcomes.append(outcome)
    _require_any(outcomes, partial.folder)
    with _errors_name(partial.dataset):
        close_dataset(dataset)
    write_provenance(partial.dataset, settings, outcomes)
    write_index(partial.dataset)
    return outcomes


@contextmanager
def _errors_name(dataset: Path) -> Iterator[None]:
    """Let errors of the library's files say where they are; it only logs that a picture could not be written."""
    try:
        yield
    except UnidentifiedImageError as error:
        raise OSError(errno.EIO, "a picture could not be written", str(dataset)) from error
    except OSError as error:
        if error.filename:
            raise
        raise named(error, dataset) from error


def _require_any(outcomes: list[Outcome], folder: Path) -> None:
    if any(outcome["kept"] for outcome in outcomes):
        return
    if all(_is_absent(outcome) for outcome in outcomes):
        raise DatasetError(
            f"none of the {len(outcomes)} targets asked for is offered by its start; remove {folder} and choose "
            "earlier --stages"
        )
    if waited := sum(outcome["mask_missing_frames"] > 0 for outcome in outcomes):
        raise DatasetError(
            f"in {waited} of {len(outcomes)} episodes the machine waited for its mask, which no replay can repeat, and "
            f"no other succeeded, so there is nothing to write; remove {folder} and choose another --env.mask_source"
        )
    raise DatasetError(
        f"none of {len(outcomes)} episodes succeeded, so there is nothing to write; to look at them, remove {folder} "
        "and record again with --keep_failures=true (the time limit is --env.episode_length)"
    )


def _start(
    pool: Executor, progress: EpisodeProgress, settings: DemonstrationSettings, folder: Path
) -> list[Future[list[Outcome]]]:
    """Submit all episodes in their order: one by one, or scene by scene where stages of a scene are to be reached."""
    if settings.stages != "0":
        return [submit_episodes(pool, progress, simulate_scene, settings, i, folder) for i in settings.scene_ids]
    return [_start_one(pool, progress, settings, pair, folder) for pair in settings.pairs()]


def _start_one(
    pool: Executor, progress: EpisodeProgress, settings: DemonstrationSettings, pair: Pair, folder: Path
) -> Future[list[Outcome]]:
    """Submit an episode, unless it is finished already."""
    finished = EpisodeStore(folder).outcome(pair)
    if finished is None:
        return submit_episodes(pool, progress, simulate_episodes, settings, pair, folder)
    progress.skip()
    future: Future[list[Outcome]] = Future()
    future.set_result([finished])
    return future


def _is_absent(outcome: Outcome) -> bool:
    return outcome.get("absent", False)
