"""The metrics file: one JSON object per finished episode of an evaluation.

LeRobot keeps rewards and success only. This file keeps the rest, written by the main process, in the order
in which LeRobot counts: line `i` of an evaluation is `per_episode[i]` of its `eval_info.json`.

    {"episode_ix": 0, "seed": 1000, "simulation_version": 2, "task": "Scoop-v0", "scene_set": "test",
     "scene_id": 1000, "target_id": 0, "mask_condition": "correct", "soil": "sand", "is_success": true, ...}

All but the first two entries are the environment's `episode_metrics`. A number that does not exist, such as
the time of a loading that never began, is `null`.

LeRobot runs whole batches, and drops the episodes beyond those asked for. `episode_ix` tells them apart, and
`max_episodes` leaves them out. Every evaluation of a training run appends, and starts again at `episode_ix` 0.
"""

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lerobot_excav.envs.configs.provenance import write_provenance
from lerobot_excav.errors import ConfigurationError, require


class MetricsLog:
    """Collect the episodes of a batch and append them, in order, once all have finished.

    Args:
        path: File to append to; its folder is made.
        n_envs: Environments in a batch.
        max_episodes: Episodes of the evaluation to write; None writes all.

    Raises:
        ConfigurationError: The file cannot be written.
    """

    def __init__(self, path: Path, *, n_envs: int, max_episodes: int | None = None) -> None:
        self.path = Path(path)
        self._max_episodes = max_episodes
        self._n_envs = n_envs
        self._batch = -1
        self._seeds: Sequence[int | None] = [None] * n_envs
        self._finished: dict[int, dict[str, Any]] = {}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._append([])
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
        place = {"episode_ix": self._batch * self._n_envs + env_index, "seed": self._seeds[env_index]}
        self._finished[env_index] = {**place, **info["episode_metrics"]}
        if len(self._finished) == self._n_envs:
            self._append([self._finished[i] for i in range(self._n_envs)])
            write_provenance(self.path)

    def _append(self, lines: list[dict[str, Any]]) -> None:
        """Append whole lines by one write each, so that two evaluations may share a file."""
        descriptor = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            for line in lines:
                if self._max_episodes is None or line["episode_ix"] < self._max_episodes:
                    os.write(descriptor, json_line(line).encode())
        finally:
            os.close(descriptor)


def json_line(record: Mapping[str, Any]) -> str:
    """Return a record as a line of JSON."""
    return json.dumps({key: _plain(value) for key, value in record.items()}, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    """Turn NumPy scalars into Python's own, and numbers that JSON lacks into None."""
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
