"""Many cases in several processes."""

from collections.abc import Iterator
from concurrent.futures import as_completed
from pathlib import Path

from tqdm import tqdm

from lerobot_excav.datasets.record.workers import worker_pool
from lerobot_excav.errors import require
from lerobot_excav.evaluation.fuzz.case import Failure, FuzzCase, play

STEPS_PER_CASE = 400


def fuzz(
    steps: int,
    *,
    seed: int = 0,
    first_case: int = 0,
    workers: int = 2,
    out: Path,
    show_progress: bool = True,
) -> list[tuple[Path, Failure]]:
    """Play random actions and look for states that must not be.

    Args:
        steps: Environment steps in total.
        seed: Seed of everything random.
        first_case: Number of the first case: goes on where another run ended.
        workers: Worker processes; 0 works in this process.
        out: Folder for a file per failure; made when there is one.
        show_progress: Whether to draw a progress bar.

    Returns:
        The failures by number of their case, with their files.

    Raises:
        ConfigurationError: A number is not possible.
    """
    require(steps >= 1, f"--steps={steps} must be at least 1")
    require(seed >= 0, f"--seed={seed} must not be negative")
    require(first_case >= 0, f"--first-case={first_case} must not be negative")
    failures: dict[int, tuple[Path, Failure]] = {}
    with (
        worker_pool(workers) as pool,
        tqdm(total=steps, unit="step", disable=not show_progress, smoothing=0.05) as bar,
    ):
        jobs = {pool.submit(play, case): case for case in cases(steps, seed, first_case)}
        for job in as_completed(jobs):
            case, failure = jobs[job], job.result()
            if failure is not None:
                path = out / f"seed{case.seed}_case{case.number}.json"
                failure.write(path)
                failures[case.number] = path, failure
                bar.write(f"{failure.case}, step {failure.step}: {failure.problem}\n  actions: {path}")
            bar.update(case.steps)
    return [failures[number] for number in sorted(failures)]


def cases(steps: int, seed: int, first_case: int) -> Iterator[FuzzCase]:
    """Divide steps into cases; the last one may be shorter."""
    for number, done in enumerate(range(0, steps, STEPS_PER_CASE), first_case):
        yield FuzzCase(seed=seed, number=number, steps=min(STEPS_PER_CASE, steps - done))
