"""Worker processes for episodes: started fresh, single-threaded, and gone when their parent is."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any

from lerobot_excav.datasets.record.progress import EpisodeProgress
from lerobot_excav.errors import ExcavError, require_integer

# Every worker is one simulation; libraries that start threads of their own would only fight over the cores.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "LP_NUM_THREADS"), "1")

MOST_WORKERS = 1024


def require_workers(workers: int) -> None:
    """Check a number of worker processes.

    Raises:
        ConfigurationError: It is negative, or more than any machine has.
    """
    require_integer("--workers", workers, 0, MOST_WORKERS, hint="0 works in this process, 2 in two others.")


@contextmanager
def worker_pool(workers: int) -> Iterator[Executor]:
    """Provide an executor of worker processes; what is not yet started is cancelled when the block ends.

    Args:
        workers: Number of processes; 0 runs every job at once in this process (slow, but easy to debug).

    Raises:
        ConfigurationError: The number is not possible.
    """
    require_workers(workers)
    if workers == 0:
        yield InProcessExecutor()
        return
    # Children take their environment at their start, which is at the first submissions.
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(_ONE_THREAD)
    # A forked process would inherit graphics contexts and threads that do not work in it.
    context = multiprocessing.get_context("spawn")
    executor = ProcessPoolExecutor(workers, mp_context=context, initializer=_become_worker)
    try:
        yield executor
    finally:
        executor.shutdown(wait=True, cancel_futures=True)
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def submit_episodes[Result: Mapping[str, Any]](
    pool: Executor, progress: EpisodeProgress, play: Callable[..., list[Result]], *arguments: Any
) -> Future[list[Result]]:
    """Submit episodes to a pool, for one process and to be counted when done; `play` returns their outcomes.

    An outcome has an entry `success`; one with `absent` was not played.
    """

    def count(future: Future[list[Result]]) -> None:
        if not future.cancelled() and future.exception() is None:
            for outcome in future.result():
                if outcome.get("absent", False):
                    progress.skip()
                else:
                    progress.count(success=bool(outcome["success"]))

    future = pool.submit(play, *arguments)
    future.add_done_callback(count)
    return future


def episode_results[Result](future: Future[list[Result]]) -> list[Result]:
    """Wait for the outcomes of episodes.

    Raises:
        ExcavError: A worker died, or an episode could not be played; the message names it.
    """
    try:
        return future.result()
    except BrokenProcessPool as error:
        raise ExcavError(
            "a worker process died (out of memory?); run the command again, with --resume=true where it has that, and "
            "perhaps with fewer --workers"
        ) from error


class InProcessExecutor(Executor):
    """Runs each job when it is submitted."""

    def submit[T](self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Run a job and return its outcome as a future."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def _become_worker() -> None:
    # Ctrl-C reaches the whole process group; the parent decides what to do.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent is gone, even if the parent was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
