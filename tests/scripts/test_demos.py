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


def command(env, out, *options):
    module = [sys.executable, "-m", "lerobot_excav.scripts.main"]
    return [*module, "demos", f"--env={env}", *SHORT, f"--out={out}", *options]


def frames(root):
    return [row for path in sorted(root.glob("data/*/*.parquet")) for row in pq.read_table(path).to_pylist()]


@pytest.fixture(scope="module", params=["excavator", "fr5_grasp"])
def env(request):
    return request.param


@pytest.fixture(scope="module")
def whole(env, tmp_path_factory):
    """Record four short episodes in this process."""
    out = tmp_path_factory.mktemp("demos") / "whole"
    assert main(["demos", f"--env={env}", *SHORT, f"--out={out}", "--workers=0"]) == 0
    return out


@pytest.mark.slow
def test_a_killed_run_continues_to_the_same_dataset_with_other_workers(env, whole, tmp_path):
    out = tmp_path / "killed"
    log = (tmp_path / "log").open("wb")
    run = subprocess.Popen(command(env, out, "--workers=2"), start_new_session=True, stdout=log, stderr=log)
    deadline = time.monotonic() + 600
    while not list(tmp_path.glob("killed.partial/episodes/*.json")):
        assert time.monotonic() < deadline, "no episode was finished"
        assert run.poll() is None, (tmp_path / "log").read_text()
        time.sleep(0.02)
    os.killpg(run.pid, signal.SIGKILL)
    run.wait()
    assert not out.exists()

    assert subprocess.run(command(env, out, "--workers=1", "--resume"), check=False).returncode == 0
    assert frames(out) == frames(whole)
    assert not (tmp_path / "killed.partial").exists()


def test_the_summary_says_what_was_left_out(env, whole, capsys):
    assert main(["demos", f"--env={env}", *SHORT, f"--out={whole}", "--resume"]) == 0
    output = capsys.readouterr().out
    assert "4 episodes of 2 scenes" in output
    assert f"4 episodes without success (kept): {env}/train/0/0 {env}/train/0/1" in output
    assert "x real time" in output


def test_recorded_frames_have_the_environments_pictures(env, whole):
    from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings

    item = LeRobotDataset("local/whole", root=whole, video_backend="pyav")[0]
    settings = DemonstrationSettings.of(env, height=32, width=32)
    played = settings.environment.rig().environment(settings)
    observation, _ = played.reset(options={"scene_id": 0, "target_id": 0})
    played.close()
    for camera, picture in observation["pixels"].items():
        recorded = (item[f"observation.images.{camera}"].numpy() * 255).round().transpose(1, 2, 0)
        # A video's conversion of colours rounds; black and white stay what they are.
        is_exact = settings.storage == "image" or camera == "target_mask"
        np.testing.assert_allclose(recorded, picture, atol=0 if is_exact else 2)
    np.testing.assert_array_equal(item["observation.state"], observation["agent_pos"])


def test_a_recorded_dataset_replays_and_passes_the_check(whole, capsys):
    assert main(["qc", str(whole), "--replays=4"]) == 0
    assert "4 of 4 episodes passed; 4 of them were replayed" in capsys.readouterr().out


def test_an_existing_folder_is_an_error_of_usage(env, whole, capsys):
    assert main(["demos", f"--env={env}", *SHORT, f"--out={whole}"]) == 2
    assert "exists" in capsys.readouterr().err
