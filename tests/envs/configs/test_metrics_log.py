"""The metrics file holds each counted episode once, in LeRobot's order."""

import json
import os

import numpy as np
import pytest

from lerobot_excav.envs.configs.metrics_log import MetricsLog
from lerobot_excav.errors import ConfigurationError


@pytest.fixture
def log(tmp_path):
    return MetricsLog(tmp_path / "new" / "metrics.jsonl", n_envs=2)


def finish(log, i, **metrics):
    log.finish_episode(i, {"is_success": np.all([]), "scene_id": 0, "target_id": 1, "episode_metrics": metrics})


def play(log, seeds, **metrics):
    """Play a batch in which both environments finish."""
    log.begin_batch(seeds)
    for i in range(2):
        finish(log, i, **metrics)


def lines_of(log):
    return [json.loads(line) for line in log.path.read_text().splitlines()]


def test_lines_follow_the_seeds_not_the_finish(log):
    log.begin_batch([7, 8])
    finish(log, 1)
    assert lines_of(log) == []
    finish(log, 0)
    play(log, [9, 10])
    assert [(line["episode_ix"], line["seed"]) for line in lines_of(log)] == [(0, 7), (1, 8), (2, 9), (3, 10)]


def test_an_episode_is_scored_once(log):
    log.begin_batch([7, 8])
    for number, i in enumerate((0, 0, 1, 1)):
        finish(log, i, mass_kg=number)
    assert [line["mass_kg"] for line in lines_of(log)] == [0, 2]


def test_an_interrupted_batch_is_dropped(log):
    log.begin_batch([7, 8])
    finish(log, 0)
    log.begin_batch([9, 10])
    assert lines_of(log) == []


def test_a_line_is_place_and_seed_and_what_the_environment_says_as_plain_values_and_null_for_missing_numbers(log):
    play(log, [None, None], mass=np.float32(0.5), contacts=np.int64(2), distance=float("nan"), phase="dump")
    expected = {"episode_ix": 0, "seed": None, "mass": 0.5, "contacts": 2, "distance": None, "phase": "dump"}
    line = lines_of(log)[0]
    assert line.pop("evaluation")
    assert line == expected


def test_an_episode_without_metrics_is_refused(log):
    log.begin_batch([7, 8])
    with pytest.raises(ConfigurationError, match=r"episode_metrics.*episode_length"):
        log.finish_episode(0, {"is_success": False})


def test_an_existing_file_is_appended_to(log):
    log.path.write_text('{"earlier": 1}\n')
    play(log, [7, 8])
    assert [line.get("earlier") for line in lines_of(log)] == [1, None, None]


@pytest.mark.parametrize("text", ["years of work", "\n", "[1]\n"])
def test_a_file_that_holds_something_else_is_kept(tmp_path, text):
    (tmp_path / "thesis.tex").write_text(text)
    with pytest.raises(
        ConfigurationError, match=r"env\.metrics_path=\S*thesis\.tex' holds something else than metrics"
    ):
        MetricsLog(tmp_path / "thesis.tex", n_envs=1)
    assert (tmp_path / "thesis.tex").read_text() == text


def test_a_disk_that_fills_within_a_line_leaves_no_part_of_it(log, monkeypatch):
    play(log, [7, 8])
    write = os.write
    monkeypatch.setattr(os, "write", lambda descriptor, line: write(descriptor, line[:10]))
    with pytest.raises(OSError, match=r"No space left on device: .*metrics\.jsonl"):
        play(log, [9, 10])
    assert len(lines_of(log)) == 2


def test_a_file_that_cannot_be_written_is_refused_at_once(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigurationError, match=r"env\.metrics_path=.*cannot be written"):
        MetricsLog(tmp_path / "file" / "metrics.jsonl", n_envs=1)
