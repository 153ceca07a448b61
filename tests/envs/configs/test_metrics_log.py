"""The metrics file holds each counted episode once, in LeRobot's order."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lerobot_excav.envs.configs.metrics_log import MetricsLog
from lerobot_excav.errors import ConfigurationError


def final_info(**metrics: Any) -> dict[str, Any]:
    return {"is_success": np.all([]), "scene_id": 0, "target_id": 1, "episode_metrics": metrics}


def lines_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


@pytest.fixture
def log(tmp_path: Path) -> MetricsLog:
    return MetricsLog(tmp_path / "new" / "metrics.jsonl", n_envs=2)


def test_lines_follow_the_seeds_not_the_finish(log: MetricsLog) -> None:
    log.begin_batch([7, 8])
    log.finish_episode(1, final_info(scene_id=8))
    assert lines_of(log.path) == []
    log.finish_episode(0, final_info(scene_id=7))
    log.begin_batch([9, 10])
    log.finish_episode(0, final_info(scene_id=9))
    log.finish_episode(1, final_info(scene_id=10))
    assert [(line["episode_ix"], line["seed"]) for line in lines_of(log.path)] == [(0, 7), (1, 8), (2, 9), (3, 10)]


def test_a_line_is_place_and_seed_and_what_the_environment_says(log: MetricsLog) -> None:
    log.begin_batch([7, 8])
    for i in range(2):
        log.finish_episode(i, final_info(is_success=False, mass_kg=1.0))
    assert lines_of(log.path)[1] == {"episode_ix": 1, "seed": 8, "is_success": False, "mass_kg": 1.0}


def test_an_episode_is_scored_once(log: MetricsLog) -> None:
    log.begin_batch([7, 8])
    log.finish_episode(0, final_info(mass_kg=1.0))
    log.finish_episode(0, final_info(mass_kg=2.0))
    log.finish_episode(1, final_info(mass_kg=3.0))
    log.finish_episode(1, final_info(mass_kg=4.0))
    assert [line["mass_kg"] for line in lines_of(log.path)] == [1.0, 3.0]


def test_an_interrupted_batch_is_dropped(log: MetricsLog) -> None:
    log.begin_batch([7, 8])
    log.finish_episode(0, final_info())
    log.begin_batch([9, 10])
    assert lines_of(log.path) == []


def test_surplus_episodes_are_left_out_on_request(tmp_path: Path) -> None:
    log = MetricsLog(tmp_path / "metrics.jsonl", n_envs=2, max_episodes=3)
    for first_seed in (7, 9):
        log.begin_batch([first_seed, first_seed + 1])
        for i in range(2):
            log.finish_episode(i, final_info())
    assert [line["seed"] for line in lines_of(log.path)] == [7, 8, 9]


def test_numpy_values_become_plain_and_missing_numbers_null(log: MetricsLog) -> None:
    log.begin_batch([None, None])
    values = {"mass_kg": np.float32(0.5), "contacts": np.int64(2), "distance_m": float("nan"), "phase": "dump"}
    for i in range(2):
        log.finish_episode(i, final_info(**values))
    line = lines_of(log.path)[0]
    assert line["seed"] is None
    assert (line["mass_kg"], line["contacts"], line["distance_m"], line["phase"]) == (0.5, 2, None, "dump")


def test_an_episode_without_metrics_is_refused(log: MetricsLog) -> None:
    log.begin_batch([7, 8])
    with pytest.raises(ConfigurationError, match=r"episode_metrics.*episode_length"):
        log.finish_episode(0, {"is_success": False})


def test_an_existing_file_is_appended_to(log: MetricsLog) -> None:
    log.path.write_text('{"earlier": 1}\n')
    log.begin_batch([7, 8])
    for i in range(2):
        log.finish_episode(i, final_info())
    assert [line.get("earlier") for line in lines_of(log.path)] == [1, None, None]


def test_a_file_that_cannot_be_written_is_refused_at_once(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigurationError, match=r"env\.metrics_path=.*cannot be written"):
        MetricsLog(tmp_path / "file" / "metrics.jsonl", n_envs=1)
