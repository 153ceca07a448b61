"""A dataset of the second task of a robot: read, checked and replayed as what it is."""

import json

import pytest
from lerobot.datasets import merge_datasets

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.format.episode_table import iterate_episodes
from lerobot_excav.datasets.format.schema import COMMAND_KEY, PAIR_KEY, SCENE_KEY, TARGET_KEY, TASK_KEY
from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.envs.tasks.clear import clearing
from lerobot_excav.scripts.main import main

from ..toy import load

SMALL = {"observation_height": 48, "observation_width": 64, "fidelity": "fast", "episode_length": 25}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A dataset of each task, whose cycles last 1 s and whose episodes 2.5 s."""
    folder = tmp_path_factory.mktemp("tasks")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clearing, "CYCLE_LIMIT_S", 1.0)
        for task in ("Clear-v0", "Scoop-v0"):
            settings = DemonstrationSettings.of(
                "excavator", {**SMALL, "task": task}, scenes=1, keep_failures=True, **({"targets": 1})
            )
            record_demonstrations(settings, folder / task, workers=0, show_progress=False)
        merge_datasets([load(folder / task) for task in ("Clear-v0", "Scoop-v0")], "local/both", folder / "both")
        yield folder


@pytest.mark.slow
def test_a_dataset_of_clearing_is_read_as_such_and_its_commands_are_seen_though_their_number_stays(folder):
    keys = (TASK_KEY, COMMAND_KEY, TARGET_KEY, PAIR_KEY, SCENE_KEY)
    (episode,) = iterate_episodes(folder / "Clear-v0", keys)
    assert episode.spec.id == "Clear-v0"
    assert episode.schedule == ((10, 0), (20, 0))
    assert json.loads((folder / "Clear-v0/meta/info.json").read_text())["robot_type"] == "excavator_sim"


def test_tasks_merge_and_every_episode_is_checked_and_replayed_as_its_own(folder):
    report = check_dataset(folder / "both", replays=2)
    assert report.problems == []
    assert report.episodes["qc_problem"].tolist() == ["", ""]
    assert report.episodes["replayed"].all()
    index = build_index(folder / "both")
    assert index["task"].tolist() == ["Clear-v0", "Scoop-v0"]
    assert index["commands"].tolist() == [3, 1]


def test_the_index_sums_up_each_task(folder, capsys):
    assert main(["index", str(folder / "both")]) == 0
    text = capsys.readouterr().out
    assert "task: Clear-v0, 1 episodes; Scoop-v0, 1 episodes" in text
    assert "kg per pile on average" in text
    assert "duplicate" not in text


def test_clearing_begins_with_the_planners_choice_unless_more_targets_are_asked_for():
    def targets(**settings):
        return [pair.target_id for pair in DemonstrationSettings.of("excavator", **settings).pairs()]

    assert targets(env={"task": "Clear-v0"}, scenes=3) == [0, 0, 0]
    assert targets(env={"task": "Clear-v0"}, scenes=1, targets=2) == [0, 1]
    assert targets(scenes=3, targets=1) == [0, 1, 2]
    assert targets(scenes=1) == [0, 1, 2, 3]
