"""The command as a user runs it: real simulation, processes of its own, killed in the middle."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow.parquet as pq
import pytest

from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.envs.tasks.registry import env_types
from lerobot_excav.scripts.main import main

from ..datasets.toy import load

SIZE = {"observation_height": 32, "observation_width": 32}
SHORT = ("--scenes=2", "--targets=2", "--keep_failures", "--env.episode_length=4",
         *(f"--env.{name}={size}" for name, size in SIZE.items()))  # fmt: skip
OPTIONS = {
    "excavator": ("--env.type=excavator", *SHORT),
    "fr5_grasp": ("--env.type=fr5_grasp", "--env.retarget_frame=2", *SHORT),
}


def frames(root):
    return [row for path in sorted(root.glob("data/*/*.parquet")) for row in pq.read_table(path).to_pylist()]


def picture(item, camera):
    return (item[f"observation.images.{camera}"].numpy() * 255).round().transpose(1, 2, 0)


@pytest.fixture(scope="module", params=OPTIONS)
def env_type(request):
    return request.param


@pytest.fixture(scope="module")
def whole(env_type, tmp_path_factory):
    """Record four short episodes in this process; the arm's command changes within each."""
    out = tmp_path_factory.mktemp("demos") / "whole"
    assert main(["demos", *OPTIONS[env_type], f"--out={out}", "--workers=0"]) == 0
    return out


@pytest.mark.slow
@pytest.mark.parametrize("env_type", ["fr5_grasp"], indirect=True)  # the one whose commands change
def test_a_killed_run_continues_to_the_same_dataset_with_other_workers(env_type, whole, tmp_path):
    out = tmp_path / "killed"
    command = [sys.executable, "-m", "lerobot_excav.scripts.main", "demos", *OPTIONS[env_type], f"--out={out}"]
    log = (tmp_path / "log").open("wb")
    run = subprocess.Popen([*command, "--workers=2"], start_new_session=True, stdout=log, stderr=log)
    deadline = time.monotonic() + 600
    while not list(tmp_path.glob("killed.partial/episodes/*.json")):
        assert time.monotonic() < deadline, "no episode was finished"
        assert run.poll() is None, (tmp_path / "log").read_text()
        time.sleep(0.02)
    os.killpg(run.pid, signal.SIGKILL)
    run.wait()
    assert not out.exists()

    assert subprocess.run([*command, "--workers=1", "--resume"], check=False).returncode == 0
    assert frames(out) == frames(whole)
    assert not (tmp_path / "killed.partial").exists()


def test_the_summary_says_what_was_left_out(env_type, whole, capsys):
    assert main(["demos", *OPTIONS[env_type], f"--out={whole}", "--resume"]) == 0
    output = capsys.readouterr().out
    assert "4 episodes of 2 scenes" in output
    assert f"4 episodes without success (kept): {env_type}/train/0/0/0 {env_type}/train/0/0/1" in output
    assert "x real time" in output
    assert main(["demos", *OPTIONS[env_type], f"--out={whole}"]) == 2
    assert "exists" in capsys.readouterr().err


def test_a_recorded_dataset_replays_and_passes_the_check(env_type, whole, capsys):
    assert main(["qc", str(whole), "--replays=4"]) == 0
    assert "4 of 4 episodes passed; 4 of them were replayed" in capsys.readouterr().out
    index = build_index(whole)
    changes = env_type == "fr5_grasp"
    assert (index["commands"] == 1 + changes).all()
    assert ((index["final_target_id"] != index["target_id"]) == changes).all()


@pytest.mark.parametrize(
    ("options", "settings", "words"),
    [
        (["--env.mask_condition=zero"], {"mask_condition": "zero"}, "oracle, zero"),
        (["--env.mask_condition=random"], {"mask_condition": "random"}, "oracle, random"),
        (
            ["--env.mask_noise=dilate", "--env.mask_noise_px=2"],
            {"mask_noise": "dilate", "mask_noise_px": 2},
            "oracle, dilate 2 px",
        ),
        (
            ["--env.target_overlay", "--env.mask_condition=mismatched"],
            {"target_overlay": True, "mask_condition": "mismatched"},
            "oracle, mismatched, as overlay",
        ),
    ],
)
def test_options_of_the_mask_reach_the_recorded_pictures(tmp_path, options, settings, words):
    toy = ["--env.type=toy_reach", "--scenes=1", "--targets=1", "--workers=0", f"--out={tmp_path / 'd'}"]
    assert main(["demos", *toy, *(f"--env.{name}=32" for name in SIZE), *options]) == 0
    item = load(tmp_path / "d")[0]
    assert item["excav.mask_source"] == words
    shown, plain = (
        env_types()["toy_reach"].make_env(**SIZE, **changes).reset(options={"scene_id": 0, "target_id": 0})[0]["pixels"]
        for changes in (settings, {})
    )
    for camera, expected in shown.items():
        np.testing.assert_array_equal(picture(item, camera), expected)
    changed = {camera for camera in shown if not np.array_equal(shown[camera], plain[camera])}
    assert changed == ({"target_mask", "main"} if "target_overlay" in settings else {"target_mask"})
