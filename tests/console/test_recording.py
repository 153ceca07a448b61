"""Demonstrations recorded at the console: the schedule, the verdict, the dataset."""

import json
from pathlib import Path

import numpy as np
import pytest
from lerobot.datasets import LeRobotDataset

from lerobot_excav.console.recording import Recording
from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.errors import ConfigurationError, DatasetError

from .conftest import CENTRE, Planted, axes_of

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
CURL = [0.0, 0.0, -0.5, 0.0]
SHORT = 6


@pytest.fixture
def recorded(open_driver, tmp_path):
    """A driver who has recorded a whole cycle of the first target, and a few frames of the others."""
    driver = open_driver(out=tmp_path / "by_hand", policy=Planted())
    driver.wish("record")
    driver.dig()
    assert driver.state["recording"]["verdict"]["success"]
    driver.wish("keep")
    for _ in range(2):
        driver.wish("record")
        driver.tick(CURL, times=SHORT)
        driver.wish("finish")
        driver.wish("keep")
    driver.wish("record")
    driver.tick(CURL, times=2)
    driver.wish("work")
    driver.tick(times=SHORT)  # the policy acts in the frame of the wish too
    driver.tick(axes_of([0.5, 0.0, 0.0, 0.0]), times=3)
    driver.wish("stop")
    driver.wish("drive")
    driver.tick(CURL, times=2)
    driver.wish("finish")
    driver.wish("keep")
    return driver


def test_a_recorded_dataset_is_complete_passes_qc_and_says_who_commanded(recorded, tmp_path):
    out = tmp_path / "by_hand"
    assert "write the dataset" in recorded.state["words"]
    assert not out.exists()
    recorded.wish("complete")
    assert recorded.state["recording"]["complete"]
    assert str(out) in recorded.state["words"]
    assert not (tmp_path / "by_hand.partial").exists()
    dataset = LeRobotDataset("local/by_hand", root=out)
    assert dataset.num_episodes == 4
    rows = dataset.hf_dataset.with_format("numpy")
    episode = np.array(rows["episode_index"])
    assert sorted(np.unique(np.array(rows["excav.pair_uid"]))) == [f"excavator/train/0/0/{i}" for i in range(4)]
    operators = {int(i): set(np.array(rows["excav.operator"])[episode == i]) for i in range(4)}
    assert operators == {0: {"person"}, 1: {"person"}, 2: {"person"}, 3: {"policy"}}
    took_over = np.array(rows["excav.intervention"]).ravel()
    assert not took_over[episode < 3].any()
    # What a person did before the policy has begun is marked, too: it is not the policy's.
    assert took_over[episode == 3].tolist() == [True] * 2 + [False] * (SHORT + 1) + [True] * 5
    success = np.array(rows["excav.success"]).ravel()
    assert [bool(success[episode == i][0]) for i in range(4)] == [True, False, False, False]
    report = check_dataset(out, replays=4, show_progress=False)
    assert report.has_passed, report


def test_a_recording_continues_where_it_was_left_and_knows_what_is_kept(recorded, open_driver, tmp_path):
    out = tmp_path / "by_hand"
    recorded.console.recorder.close()
    again = open_driver(out=out)
    assert again.state["recording"]["left"] == 0
    assert again.state["recording"]["kept"] == 4
    again.wish("record")
    assert "every start is recorded" in again.state["words"]


def test_again_throws_the_episode_away_and_shows_the_same_start_and_put_off_comes_last(open_driver, tmp_path):
    driver = open_driver(out=tmp_path / "by_hand")
    driver.wish("record")
    driver.tick(CURL, times=SHORT)
    driver.wish("finish")
    assert driver.state["recording"]["verdict"] == {"success": False, "frames": SHORT}
    for kind in ("record", "drive", "work"):
        driver.wish(kind)
        assert "decide on the last episode first" in driver.state["words"]
    driver.wish("again")
    assert (driver.state["frame"], driver.state["target"], driver.state["recording"]["kept"]) == (0, 0, 0)
    driver.wish("skip")
    assert driver.state["recording"]["next"]["target_id"] == 1
    driver.wish("record")
    assert driver.state["target"] == 1
    driver.wish("point", x=0.6, y=0.55)
    assert "an episode is being recorded" in driver.state["words"]
    driver.tick(CURL)
    for kind, words in (("record", "finish it first"), ("skip", "an episode is in hand")):
        driver.wish(kind)  # such as by a button of the pad
        assert words in driver.state["words"]
    assert driver.state["recording"]["frames"] > 0
    driver.wish("finish")
    driver.wish("again")
    driver.wish("skip")
    for target in (2, 3, 0, 1):
        driver.wish("record")
        assert driver.state["target"] == target
        driver.tick(CURL, times=2)
        driver.wish("finish")
        driver.wish("keep")


def test_an_episode_without_a_frame_is_no_episode(open_driver, tmp_path):
    driver = open_driver(out=tmp_path / "by_hand")
    driver.wish("record")
    driver.wish("finish")
    assert "nothing to finish yet" in driver.state["words"]
    assert driver.state["recording"]["verdict"] is None
    assert driver.state["recording"]["left"] == 4


def test_frames_before_the_first_motion_are_not_recorded_and_a_pause_leaves_none_out(open_driver, tmp_path):
    driver = open_driver(out=tmp_path / "by_hand")
    driver.wish("record")
    driver.tick(times=20)
    driver.wish("drive")  # as a person may press, who does not know that it is on
    driver.tick(times=5)
    assert driver.state["recording"]["frames"] == 0
    driver.tick(CURL, times=3)
    driver.wish("stop")
    driver.tick(CURL, times=5)
    assert driver.state["recording"]["frames"] == 3
    driver.wish("drive")
    driver.tick(CURL, times=3)
    assert driver.state["recording"]["frames"] == 6


def test_nothing_is_written_over_and_other_settings_do_not_mix(tmp_path):
    out = tmp_path / "by_hand"
    settings = DemonstrationSettings.of("excavator", {"fidelity": "fast"}, scenes=1)
    other = DemonstrationSettings.of("excavator", {"fidelity": "fast"}, scenes=2)
    recording = Recording(settings, out)
    with pytest.raises(DatasetError, match="no episode is kept yet"):
        recording.complete()
    with pytest.raises(DatasetError, match="process"):
        Recording(settings, out)
    recording.close()
    with pytest.raises(ConfigurationError, match="scenes"):
        Recording(other, out)
    out.mkdir()
    (out / "thesis.md").write_text("three years")
    with pytest.raises(DatasetError, match="exists"):
        Recording(settings, out)
    assert (out / "thesis.md").read_text() == "three years"


def test_a_targets_absence_at_a_late_stage_is_noted_and_the_next_one_shown(open_driver, tmp_path, monkeypatch):
    from lerobot_excav.envs.tasks.selection import TargetAbsentError

    driver = open_driver(out=tmp_path / "by_hand")
    start = type(driver.console).start

    def without_the_first(console, **options):
        if options["target_id"] == 0:
            raise TargetAbsentError("there is none")
        start(console, **options)

    monkeypatch.setattr(type(driver.console), "start", without_the_first)
    driver.wish("record")
    assert driver.state["target"] == 1
    assert driver.state["recording"]["left"] == 3


@pytest.mark.slow
def test_demonstrations_by_hand_and_by_script_merge(recorded, tmp_path):
    from lerobot.datasets import merge_datasets

    recorded.wish("complete")
    scripted = DemonstrationSettings.of("excavator", {"fidelity": "fast"}, scenes=1, first_scene=1, targets=1)
    record_demonstrations(scripted, tmp_path / "scripted", workers=0, show_progress=False)
    parts = [LeRobotDataset(f"local/{name}", root=tmp_path / name) for name in ("by_hand", "scripted")]
    merged = merge_datasets(parts, output_repo_id="local/merged", output_dir=tmp_path / "merged")
    operators = np.array(merged.hf_dataset.with_format("numpy")["excav.operator"])
    assert set(operators) == {"person", "policy", "scripted"}
    info = json.loads((tmp_path / "merged" / "meta" / "info.json").read_text())
    assert info["total_episodes"] == 5


@pytest.mark.parametrize("env_type", ["excavator", "fr5_grasp"])
def test_recordings_of_tasks_that_are_judged_at_the_end_pass_qc(open_driver, tmp_path, monkeypatch, env_type):
    from lerobot_excav.envs.tasks.clear import clearing

    env = {"task": "Clear-v0"} if env_type == "excavator" else {}
    driver = open_driver(env_type, env=env, out=tmp_path / "by_hand", targets=1, scenes=2)
    for frames in (12, 10):
        driver.wish("record")
        driver.tick([-0.5, 0.0, 0.0, 0.5], times=frames)
        if env:  # the cycle is given up in the last frame, and another region commanded
            monkeypatch.setattr(clearing, "CYCLE_LIMIT_S", 1.3)
            driver.tick(CENTRE)
            monkeypatch.setattr(clearing, "CYCLE_LIMIT_S", 25.0)
        driver.wish("finish")
        driver.wish("keep")
    driver.wish("complete")
    assert driver.state["recording"]["complete"], driver.state["words"]
    if env:
        monkeypatch.setattr(clearing, "CYCLE_LIMIT_S", 1.3)
    report = check_dataset(tmp_path / "by_hand", replays=2)
    assert report.has_passed, report.episodes["qc_problem"].tolist()


def test_an_episode_that_nobody_ends_is_finished_and_an_episode_length_is_refused(open_driver, tmp_path, monkeypatch):
    from lerobot_excav.console import console, opening
    from lerobot_excav.page.access import Access

    monkeypatch.setattr(console, "LONGEST_EPISODE_S", 0.5)
    driver = open_driver(out=tmp_path / "by_hand")
    driver.wish("record")
    driver.tick(CURL, times=8)
    assert driver.state["recording"]["verdict"]["frames"] == 5
    settings = DemonstrationSettings.of("excavator", {"episode_length": 50}, scenes=1)
    access = Access(host="127.0.0.1", port=1)
    with pytest.raises(ConfigurationError, match="episode_length=50 has no effect"):
        opening.open_console(settings, access=access, size=(96, 128)).__enter__()


def test_a_policy_of_another_machine_is_refused_at_the_start():
    from lerobot_excav.console import opening

    settings = DemonstrationSettings.of("excavator", scenes=1).env
    with pytest.raises(ConfigurationError, match="was trained with observation"):
        opening._policy(ROOT / "checkpoints" / "fr5_grasp_mask_act", settings)
    other = DemonstrationSettings.of("excavator", {"observation_width": 64}, scenes=1).env
    with pytest.raises(ConfigurationError, match="observation_height and _width"):
        opening._policy(ROOT / "checkpoints" / "excavator_mask_act", other)
