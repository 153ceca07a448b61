"""A tiny dataset of the example task, its target tinted into the main picture, and the stock `lerobot-train` on it."""

import sys

import pytest
import toy_reach  # noqa: F401 - registers the task
from lerobot.scripts import lerobot_train

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations


def record(out, **env):
    """Record 4 episodes; returns their folder."""
    env = {"target_overlay": True, "observation_height": 32, "observation_width": 48, **env}
    settings = DemonstrationSettings.of("toy_reach", env, scenes=1)
    record_demonstrations(settings, out, workers=0, show_progress=False)
    return out


@pytest.fixture(scope="session")
def dataset(tmp_path_factory):
    return record(tmp_path_factory.mktemp("tiny") / "data")


def train(dataset, run, *arguments):
    """Run `lerobot-train` as its console script does; returns the folder of the last checkpoint."""
    options = ["--policy.device=cpu", "--policy.push_to_hub=false", "--batch_size=4", "--num_workers=0"]
    options += ["--log_freq=1", "--wandb.enable=false", "--dataset.repo_id=tests/tiny"]
    options += [f"--dataset.root={dataset}", f"--output_dir={run}", *arguments]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["lerobot-train", *options])
        lerobot_train.main()
    return run / "checkpoints" / "last" / "pretrained_model"
