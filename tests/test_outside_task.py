"""A task and a mask source from outside the package work everywhere, without an edit elsewhere."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

pytestmark = pytest.mark.slow

TOY = Path(__file__).parents[1] / "examples" / "toy_reach"
METADATA = "Metadata-Version: 2.1\nName: lerobot_env_toy_reach\nVersion: 0.1.0\n"
ENTRY_POINTS = "[lerobot_excav.plugins]\ntoy_reach = toy_reach\n"

SOURCE = '''
"""A mask source: what is as red, green or blue as the target should be."""
import numpy as np
from lerobot_excav.envs.masks.source import TargetMask, register_mask_source

RGB = [(210, 40, 40), (40, 160, 60), (50, 70, 210), (220, 190, 40)]

class ByColour:
    def mask(self, view, command):
        pixels = (view.picture() == RGB[command.target_id]).all(axis=-1)
        if not pixels.any():
            return None
        return TargetMask(pixels=pixels, target_id=command.target_id, source="by_colour")

register_mask_source("by_colour", ByColour)
'''


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder as an installer would leave it: the example's packages, their metadata, and one file with a source."""
    site = tmp_path_factory.mktemp("site")
    for package in ("toy_reach", "lerobot_env_toy_reach"):
        (site / package).symlink_to(TOY / package)
    info = site / "lerobot_env_toy_reach-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(METADATA)
    (info / "entry_points.txt").write_text(ENTRY_POINTS + "by_colour = by_colour\n")
    (site / "by_colour.py").write_text(SOURCE)
    return site


@pytest.fixture(scope="module")
def run(site):
    """Run a command as a user of that package would."""
    path = os.pathsep.join([str(site), os.environ.get("PYTHONPATH", "")])
    env = {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1"}

    def run(*command, code=0):
        done = subprocess.run(
            [sys.executable, *map(str, command)], env=env, capture_output=True, text=True, check=False
        )
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout + done.stderr

    return run


def excav(*arguments):
    return ("-m", "lerobot_excav.scripts.main", *arguments)


@pytest.fixture(scope="module")
def dataset(run, tmp_path_factory):
    out = tmp_path_factory.mktemp("outside") / "reach"
    run(*excav("demos", "--env.type=toy_reach", "--env.observation_height=32", "--env.observation_width=48",
               "--env.table=ice", "--scenes=2", "--workers=1", f"--out={out}"))  # fmt: skip
    return out


def test_gymnasium_makes_it(run):
    code = (
        "import gymnasium as gym, lerobot_excav, toy_reach\n"
        "env = gym.make('lerobot_excav/Reach-v0', table='ice'); observation, info = env.reset(seed=3)\n"
        "print(sorted(observation['pixels']), info['target_id'])"
    )
    assert run("-c", code).strip().endswith("['main', 'near', 'target_mask'] 3")


def test_demonstrations_are_recorded_indexed_and_checked(run, dataset):
    assert "8 episodes" in run(*excav("index", dataset))
    assert "8 of 8 episodes passed; 8 of them were replayed" in run(*excav("qc", dataset, "--replays=8"))
    index = pd.read_parquet(dataset / "meta" / "excav_pairs.parquet")
    assert set(index["table"]) == {"ice"}
    assert (index["final_distance_m"] < 0.12).all()
    assert "final distance" in run(*excav("index", dataset))


def test_lerobot_eval_plays_it_and_the_report_shows_its_own_columns(run, dataset, tmp_path):
    common = ("--policy.device=cpu", "--env.type=toy_reach", "--env.observation_height=32")
    run("-m", "lerobot.scripts.lerobot_train", "--policy.type=mask_act", "--policy.preset=fast", "--policy.device=cpu",
        "--policy.push_to_hub=false", "--policy.dim_model=32", "--policy.chunk_size=4", "--policy.n_action_steps=4",
        "--dataset.repo_id=local/reach", f"--dataset.root={dataset}", "--batch_size=2", "--steps=1",
        "--num_workers=0", "--save_freq=1", f"--output_dir={tmp_path / 'train'}")  # fmt: skip
    policy = tmp_path / "train" / "checkpoints" / "last" / "pretrained_model"
    metrics = tmp_path / "metrics.jsonl"
    run("-m", "lerobot.scripts.lerobot_eval", f"--policy.path={policy}", *common, "--env.observation_width=48",
        "--env.episode_length=5", f"--env.metrics_path={metrics}", "--eval.n_episodes=2", "--eval.batch_size=2",
        "--eval.use_async_envs=true",
        "--env.mask_source=by_colour", f"--output_dir={tmp_path / 'eval'}")  # fmt: skip
    lines = [json.loads(line) for line in metrics.read_text().splitlines()]
    assert [line["mask_source"] for line in lines] == ["by_colour"] * 2
    assert "distance [m]" in run(*excav("report", metrics))


def test_the_operator_is_evaluated(run, tmp_path):
    metrics = tmp_path / "operator.jsonl"
    run(*excav("operator", "--env.type=toy_reach", "--scenes=3", "--workers=0", f"--metrics={metrics}"))
    assert np.mean([json.loads(line)["is_success"] for line in metrics.read_text().splitlines()]) > 0.9


def test_a_source_from_outside_serves_recordings_too(run, tmp_path):
    out = tmp_path / "d"
    run(*excav("demos", "--env.type=toy_reach", "--env.mask_source=by_colour", "--env.observation_height=32",
               "--env.observation_width=48", "--scenes=1", "--workers=1", f"--out={out}"))  # fmt: skip
    assert set(pd.read_parquet(out / "meta" / "excav_pairs.parquet")["mask_source"]) == {"by_colour"}


def test_an_unknown_environment_names_those_that_are_there(run, tmp_path):
    text = run(*excav("demos", "--env.type=lathe", f"--out={tmp_path / 'x'}"), code=2)
    assert all(name in text for name in ("excavator", "fr5_grasp", "toy_reach"))
