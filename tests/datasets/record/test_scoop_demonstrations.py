"""Scripted demonstrations of Scoop-v0 from two stages of a scene."""

import numpy as np
import pytest

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.format.episode_table import iterate_episodes
from lerobot_excav.datasets.pairs.paired_index import build_index, index_keys
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.datasets.record.provenance import read_provenance
from lerobot_excav.datasets.record.simulation import play_again
from lerobot_excav.envs.tasks.scoop.spec import SCOOP

pytestmark = pytest.mark.slow

SETTINGS = {"fidelity": "fast", "observation_height": 32, "observation_width": 32}


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """A scene as it is drawn, and after one dug cycle, with one target each. Not to be changed by tests."""
    out = tmp_path_factory.mktemp("scoop") / "dataset"
    settings = DemonstrationSettings.of("excavator", SETTINGS, scenes=1, targets=1, stages="0,1")
    assert record_demonstrations(settings, out, workers=0, show_progress=False).episodes == 2
    return out


@pytest.fixture(scope="module")
def episodes(dataset):
    return list(iterate_episodes(dataset, index_keys(SCOOP)))


def test_the_later_start_is_in_the_pose_after_a_dump(episodes):
    assert [episode.pair.uid for episode in episodes] == ["excavator/train/0/0/0", "excavator/train/0/1/1"]
    bucket_pos = SCOOP.state_names.index("bucket.pos")
    early, late = (episode.state[0, bucket_pos] for episode in episodes)
    assert late > early + 0.5  # the bucket is open


def test_the_resting_tail_is_cut_and_no_action_before_it(dataset, episodes):
    outcomes = read_provenance(dataset).outcomes
    for episode, outcome in zip(episodes, outcomes, strict=True):
        assert np.abs(episode.action[-1]).max() > 0.0
        assert episode.rest_frames >= 5  # the bucket has to have been empty for 0.5 s
        assert episode.length + episode.rest_frames == outcome["metrics"]["frames"]
        assert episode.length == outcome["frames"]


def test_the_outcome_is_that_after_the_rest(dataset, episodes):
    index, outcomes = build_index(dataset), read_provenance(dataset).outcomes
    for row, outcome in zip(index.itertuples(), outcomes, strict=True):
        assert row.success
        assert row.retained_mass_kg == pytest.approx(outcome["metrics"]["retained_mass_kg"], abs=0.1)
    deposited = SCOOP.task_state_names.index("deposited_mass_kg")
    assert episodes[0].outcome[deposited] > episodes[0].task_state[-1, deposited] + 20.0  # soil was still falling


def test_a_replay_holds_the_machine_still_and_comes_to_the_same_outcome(dataset, episodes):
    report = check_dataset(dataset, replays=2)
    assert report.problems == []
    assert report.episodes["qc_problem"].tolist() == ["", ""]
    assert report.episodes["replayed"].all()
    first = episodes[0]
    arguments = {"fps": 10, "columns": first.settings}
    cut_off = play_again(SCOOP, first.action, first.pair, first.schedule, **arguments)
    assert not cut_off.success  # the bucket has only just been emptied
    assert (cut_off.length, cut_off.rest_frames) == (first.length, 0)
