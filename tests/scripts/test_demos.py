"""The command as a user runs it: real simulation, processes of its own, killed in the middle."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow.parquet as pq
import pytest
from lerobot.datasets import LeRobotDataset

from lerobot_excav.scripts.main import main

SHORT = ("--scenes=2", "--targets=2", "--episode-length=4", "--keep-failures", "--height=32", "--width=32")


def command(out, *options):
    return [sys.executable, "-m", "lerobot_excav.scripts.main", "demos", *SHORT, f"--out={out}", *options]


def frames(root):
    return [row for path in sorted(root.glob("data/*/*.parquet")) for row in pq.read_table(path).to_pylist()]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Record four short episodes in this process."""
    out = tmp_path_factory.mktemp("demos") / "whole"
    assert main(["demos", *SHORT, f"--out={out}", "--workers=0"]) == 0
    return out


@pytest.mark.slow
def test_a_killed_run_continues_to_the_same_dataset_with_other_workers(whole, tmp_path):
    out = tmp_path / "killed"
    log = (tmp_path / "log").open("wb")
    run = subprocess.Popen(command(out, "--workers=2"), start_new_session=True, stdout=log, stderr=log)
    deadline = time.monotonic() + 600
    while not list(tmp_path.glob("killed.partial/episodes/*.json")):
        assert time.monotonic() < deadline, "no episode was finished"
        assert run.poll() is None, (tmp_path / "log").read_text()
        time.sleep(0.02)
    os.killpg(run.pid, signal.SIGKILL)
    run.wait()
    assert not out.exists()

    assert subprocess.run(command(out, "--workers=1", "--resume"), check=False).returncode == 0
    assert frames(out) == frames(whole)
    assert not (tmp_path / "killed.partial").exists()


def test_the_summary_says_what_was_left_out(whole, tmp_path, capsys):
    assert main(["demos", *SHORT, f"--out={whole}", "--resume"]) == 0
    output = capsys.readouterr().out
    assert "4 episodes of 2 scenes" in output
    assert "4 episodes without success (kept): excavator/train/0/0 excavator/train/0/1" in output
    assert "x real time" in output


def test_recorded_frames_have_the_environments_pictures(whole):
    from lerobot_excav.datasets.demonstration_settings import DemonstrationSettings
    from lerobot_excav.datasets.rig import ExcavatorRig

    item = LeRobotDataset("local/whole", root=whole, video_backend="pyav")[0]
    env = ExcavatorRig().environment(DemonstrationSettings(height=32, width=32))
    observation, _ = env.reset(options={"scene_id": 0, "target_id": 0})
    env.close()
    for camera, picture in observation["pixels"].items():
        recorded = (item[f"observation.images.{camera}"].numpy() * 255).round().transpose(1, 2, 0)
        np.testing.assert_array_equal(recorded.astype(np.uint8), picture)
    np.testing.assert_array_equal(item["observation.state"], observation["agent_pos"])


def test_a_recorded_dataset_replays_and_passes_the_check(whole, capsys):
    assert main(["qc", str(whole), "--replays=4"]) == 0
    assert "4 of 4 episodes passed; 4 of them were replayed" in capsys.readouterr().out


def test_an_existing_folder_is_an_error_of_usage(whole, capsys):
    assert main(["demos", *SHORT, f"--out={whole}"]) == 2
    assert "exists" in capsys.readouterr().err
