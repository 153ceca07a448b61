"""Operations of lerobot-edit-dataset on a dataset of this package, and what `qc` says afterwards.

Episodes are deleted, split and merged in format/test_storage.py.
"""

import shutil
import sys

import pytest
from lerobot.scripts import lerobot_edit_dataset

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.format.dataset_info import read_info

from .toy import MAIN

LOSSLESS = ["vcodec=h264", "pix_fmt=yuv444p", "crf=0", "g=2"]


@pytest.fixture
def edit(changing_datasets, tmp_path, monkeypatch):
    """Run an operation on a copy of a dataset of 8 episodes, by storage; returns the folder of the result."""

    def _edit(operation, *flags, storage="image", into="new"):
        shutil.copytree(changing_datasets[storage], tmp_path / "data")
        out = ["--new_repo_id=local/new", f"--new_root={tmp_path / into}"] if into != "data" else []
        words = [f"--operation.{flag}" for flag in (f"type={operation}", *flags)]
        monkeypatch.setattr(sys, "argv", ["c", "--repo_id=local/data", f"--root={tmp_path / 'data'}", *out, *words])
        lerobot_edit_dataset.main()
        return tmp_path / into

    return _edit


def assert_passes(root, episodes):
    report = check_dataset(root, replays=0)
    assert report.has_passed, report
    assert len(report.episodes) == episodes


@pytest.mark.slow
def test_the_words_of_the_task_are_changed(edit):
    assert_passes(edit("modify_tasks", "new_task=dig", into="data"), 8)


@pytest.mark.slow
def test_statistics_are_computed_again(edit):
    assert_passes(edit("recompute_stats", "skip_image_video=false", "overwrite=true", into="data"), 8)


def test_a_dataset_is_described(edit, capsys):
    edit("info", into="data")
    assert "8" in capsys.readouterr().out


@pytest.mark.slow
def test_without_a_camera_of_the_task_it_is_another_dataset(edit):
    root = edit("remove_feature", f"feature_names=['{MAIN}']")
    assert any(MAIN in problem for problem in check_dataset(root, replays=0).problems)


def test_pictures_that_lerobot_turned_into_videos_lack_what_training_needs_and_qc_says_so(edit):
    root = edit("convert_image_to_video", *[f"rgb_encoder.{each}" for each in LOSSLESS], "num_workers=1")
    assert read_info(root).features[MAIN]["dtype"] == "video"
    problems = " ".join(check_dataset(root, replays=0).problems)
    assert f"{MAIN} lacks min" in problems  # lerobot-train ends in a KeyError
    assert "lacks tasks" in problems


def test_lerobots_own_settings_for_videos_are_refused_afterwards(edit):
    report = check_dataset(edit("convert_image_to_video", "num_workers=1"), replays=0)
    assert any("blurs the mask" in problem for problem in report.problems)


@pytest.mark.slow
def test_videos_are_encoded_again_with_lossless_settings_only(edit):
    settings = [f"rgb_encoder.{each}" for each in LOSSLESS]
    assert_passes(edit("reencode_videos", *settings, storage="video"), 8)
