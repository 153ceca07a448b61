"""The metrics file: one JSON object per finished episode of an evaluation.

LeRobot keeps rewards and success only. This file keeps the rest, written by the main process, in the order
in which LeRobot counts: line `i` of an evaluation is `per_episode[i]` of its `eval_info.json`.

    {"evaluation": "5f0c2a9be1d4", "episode_ix": 0, "seed": 1000, "simulation_version": 2, "task": "Scoop-v0",
     "scene_set": "test", "scene_id": 1000, "target_id": 0, "mask_condition": "correct", "is_success": true, ...}

All but the first three entries are the environment's `episode_metrics`. A number that does not exist, such as
the time of a loading that never began, is `null`.

LeRobot runs whole batches, and drops the episodes beyond those asked for. `episode_ix` tells them apart, and
`max_episodes` leaves them out. Every evaluation of a training run appends, and starts again at `episode_ix` 0;
`evaluation`, drawn at its start, tells its lines from those of any other, also of one that runs at the same time.
"""

import errno
import json
import logging
import math
import os
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lerobot_excav.envs.configs.provenance import write_provenance
from lerobot_excav.errors import ConfigurationError, require
from lerobot_excav.whole_file import named

logger = logging.getLogger(__name__)


class MetricsLog:
    """Collect the episodes of a batch and append them, in order, once all have finished.

    Args:
        path: File to append to; its folder is made.
        n_envs: Environments in a batch.
        max_episodes: Episodes of the evaluation to write; None writes all.

    Raises:
        ConfigurationError: The file cannot be written, or holds something else.
    """

    def __init__(self, path: Path, *, n_envs: int, max_episodes: int | None = None) -> None:
        self.path = Path(path)
        self._max_episodes = max_episodes
        self._n_envs = n_envs
        self._batch = -1
        self._seeds: Sequence[int | None] = [None] * n_envs
        self._finished: dict[int, dict[str, Any]] = {}
        self._evaluation = uuid.uuid4().hex[:12]
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            require(
                _holds_objects(self.path),
                f"env.metrics_path={str(path)!r} holds something else than metrics; give another file.",
            )
            self._append([])
            self._size = self.path.stat().st_size
        except OSError as error:
            raise ConfigurationError(
                f"env.metrics_path={str(path)!r} cannot be written ({error.strerror}); "
                "give a file in a folder of your own."
            ) from error

    def begin_batch(self, seeds: Sequence[int | None]) -> None:
        """Start the next batch: an episode for each of `n_envs` environments, with its seed.

        A batch that was interrupted is dropped, as LeRobot does not count it either.
        """
        self._batch += 1
        self._seeds = seeds
        self._finished = {}

    def finish_episode(self, env_index: int, info: Mapping[str, Any]) -> None:
        """Record an episode from its last step's `info`; later calls for this environment and batch change nothing.

        Raises:
            ConfigurationError: The environment did not end the episode itself, so there are no metrics.
        """
        if self._batch < 0 or env_index in self._finished:
            return
        require(
            "episode_metrics" in info,
            "env.metrics_path needs info['episode_metrics'] at the end of an episode, and it is missing; "
            "set the length by episode_length, not by max_episode_steps or a TimeLimit of Gymnasium's.",
        )
        number = self._batch * self._n_envs + env_index
        place = {"evaluation": self._evaluation, "episode_ix": number, "seed": self._seeds[env_index]}
        self._finished[env_index] = {**place, **info["episode_metrics"]}
        if len(self._finished) == self._n_envs:
            self._warn_of_others()
            self._append([self._finished[i] for i in range(self._n_envs)])
            self._size = self.path.stat().st_size
            write_provenance(self.path)

    def _warn_of_others(self) -> None:
        if self.path.exists() and self.path.stat().st_size != self._size:
            logger.warning(
                f"env.metrics_path={str(self.path)!r} is being written by another evaluation as well, and a report "
                "will refuse the mixture; stop one of them, and give each a file of its own"
            )

    def _append(self, lines: list[dict[str, Any]]) -> None:
        """Append whole lines by one write each, so that those of another evaluation cannot end within one."""
        counted = [line for line in lines if self._max_episodes is None or line["episode_ix"] < self._max_episodes]
        descriptor = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            for line in counted:
                _write_line(descriptor, json_line(line).encode())
        except OSError as error:
            raise named(error, self.path) from error
        finally:
            os.close(descriptor)


def _write_line(descriptor: int, line: bytes) -> None:
    """Append a line, or nothing: a disk that fills within it would leave a file that cannot be read."""
    written = os.write(descriptor, line)
    if written < len(line):
        os.ftruncate(descriptor, os.fstat(descriptor).st_size - written)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _holds_objects(path: Path) -> bool:
    """Return whether a file is missing, empty, or begins with an object of JSON, and so may be appended to."""
    if not path.is_file():
        return True
    with path.open("rb") as file:
        return file.read(1) in (b"", b"{")


def json_line(record: Mapping[str, Any]) -> str:
    """Return a record as a line of JSON."""
    return json.dumps({key: _plain(value) for key, value in record.items()}, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    """Turn NumPy scalars into Python's own, and numbers that JSON lacks into None."""
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
