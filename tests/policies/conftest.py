"""A tiny dataset, and the stock `lerobot-train` on it."""

import sys

import numpy as np
import pytest
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.scripts import lerobot_train

HEIGHT, WIDTH, FRAMES = 32, 48, 12
CAMERAS = ("main", "cab", "target_mask")


def make_dataset(root, *, seed, cameras=CAMERAS):
    """Write 3 episodes of random pictures, a still mask and random motion; returns their folder."""
    image = {"dtype": "image", "shape": (HEIGHT, WIDTH, 3), "names": ["height", "width", "channels"]}
    state_names, action_names = [f"joint_{i}.pos" for i in range(8)], [f"joint_{i}.vel" for i in range(4)]
    features = {
        **{f"observation.images.{camera}": image for camera in cameras},
        "observation.state": {"dtype": "float32", "shape": (8,), "names": state_names},
        "action": {"dtype": "float32", "shape": (4,), "names": action_names},
    }
    dataset = LeRobotDataset.create("tests/tiny", fps=10, features=features, root=root, use_videos=False)
    rng = np.random.default_rng(seed)
    for episode in range(3):
        mask = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
        mask[4 + 5 * episode : 12 + 5 * episode, 8:24] = 255
        for _ in range(FRAMES):
            pictures = {name: rng.integers(0, 255, mask.shape, dtype=np.uint8) for name in cameras}
            if "target_mask" in pictures:
                pictures["target_mask"] = mask
            dataset.add_frame(
                {
                    **{f"observation.images.{camera}": picture for camera, picture in pictures.items()},
                    "observation.state": rng.normal(5.0, 2.0, 8).astype(np.float32),
                    "action": rng.uniform(-1, 1, 4).astype(np.float32),
                    "task": "dig",
                }
            )
        dataset.save_episode()
    dataset.finalize()
    return root


def train(dataset, run, *arguments):
    """Run `lerobot-train` as its console script does; returns the folder of the last checkpoint."""
    options = ["--policy.device=cpu", "--policy.push_to_hub=false", "--batch_size=4", "--num_workers=0"]
    options += ["--log_freq=1", "--wandb.enable=false", "--dataset.repo_id=tests/tiny"]
    options += [f"--dataset.root={dataset}", f"--output_dir={run}", *arguments]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["lerobot-train", *options])
        lerobot_train.main()
    return run / "checkpoints" / "last" / "pretrained_model"
