"""mask_act through the stock `lerobot-train`: train, resume, fine-tune, load."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.policies.factory import make_pre_post_processors
from lerobot.scripts import lerobot_train

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy

pytestmark = pytest.mark.slow

HEIGHT, WIDTH, FRAMES = 32, 48, 12
CAMERAS = ("main", "cab", "target_mask")


def make_dataset(root: Path, *, seed: int, cameras=CAMERAS) -> Path:
    """Write 3 episodes of random pictures, a still mask and random motion."""
    image = {"dtype": "image", "shape": (HEIGHT, WIDTH, 3), "names": ["height", "width", "channels"]}
    features = {
        **{f"observation.images.{camera}": image for camera in cameras},
        "observation.state": {
            "dtype": "float32",
            "shape": (8,),
            "names": [f"joint_{i}.pos" for i in range(8)],
        },
        "action": {"dtype": "float32", "shape": (4,), "names": [f"joint_{i}.vel" for i in range(4)]},
    }
    dataset = LeRobotDataset.create("tests/mask_act", fps=10, features=features, root=root, use_videos=False)
    rng = np.random.default_rng(seed)
    for episode in range(3):
        mask = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
        mask[4 + 5 * episode : 12 + 5 * episode, 8:24] = 255
        for _ in range(FRAMES):
            pictures = {
                camera: rng.integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8) for camera in cameras
            }
            if "target_mask" in pictures:
                pictures["target_mask"] = mask
            frame = {f"observation.images.{camera}": picture for camera, picture in pictures.items()}
            state, action = rng.normal(5.0, 2.0, 8), rng.uniform(-1, 1, 4)
            vectors = {"observation.state": state.astype(np.float32), "action": action.astype(np.float32)}
            dataset.add_frame({**frame, **vectors, "task": "dig"})
        dataset.save_episode()
    dataset.finalize()
    return root


def train(*arguments: str) -> None:
    """Run lerobot-train as its console script does."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["lerobot-train", *arguments])
        lerobot_train.main()


def dataset_arguments(root: Path) -> list[str]:
    return ["--dataset.repo_id=tests/mask_act", f"--dataset.root={root}", "--dataset.use_imagenet_stats=true"]


RUN = ["--batch_size=4", "--num_workers=0", "--log_freq=1", "--wandb.enable=false"]
POLICY = ["--policy.device=cpu", "--policy.push_to_hub=false"]
NEW_POLICY = [
    *POLICY,
    "--policy.type=mask_act",
    "--policy.preset=fast",
    "--policy.chunk_size=8",
    "--policy.dim_model=32",
]


def last_checkpoint(run: Path) -> Path:
    return run / "checkpoints" / "last" / "pretrained_model"


@pytest.fixture(scope="module")
def first_run(tmp_path_factory) -> tuple[Path, Path]:
    """A dataset and the run of 2 steps trained on it."""
    root = tmp_path_factory.mktemp("first")
    dataset, run = make_dataset(root / "data", seed=0), root / "run"
    train(
        *NEW_POLICY,
        "--policy.target_token=true",
        *dataset_arguments(dataset),
        *RUN,
        "--steps=2",
        f"--output_dir={run}",
    )
    return dataset, run


@pytest.fixture(scope="module")
def second_dataset(tmp_path_factory) -> Path:
    return make_dataset(tmp_path_factory.mktemp("second") / "data", seed=1)


def check_checkpoint(checkpoint: Path, dataset_root: Path) -> None:
    """The mask passes unscaled, the pictures do not, and the plan is finite."""
    policy = MaskACTPolicy.from_pretrained(checkpoint)
    preprocess, postprocess = make_pre_post_processors(
        policy.config,
        pretrained_path=str(checkpoint),
        preprocessor_overrides={"device_processor": {"device": "cpu"}},
    )
    item = LeRobotDataset("tests/mask_act", root=dataset_root)[0]
    batch = preprocess({key: value for key, value in item.items() if key.startswith("observation.")})
    mask = batch["observation.images.target_mask"]
    assert torch.equal(mask[0], item["observation.images.target_mask"])
    assert mask.unique().tolist() == [0.0, 1.0]
    assert batch["observation.images.main"].min() < -1
    action = postprocess(policy.select_action(batch))
    assert action.shape == (1, 4)
    assert torch.isfinite(action).all()


def test_a_trained_checkpoint_loads_with_its_mask_unscaled(first_run):
    dataset, run = first_run
    check_checkpoint(last_checkpoint(run), dataset)


def test_the_preset_reaches_the_checkpoint_and_gives_way_to_flags(first_run):
    _, run = first_run
    config = json.loads((last_checkpoint(run) / "config.json").read_text())
    chosen = {
        name: config[name] for name in ("preset", "vision_backbone", "dim_model", "use_vae", "n_action_steps")
    }
    assert chosen == {
        "preset": "fast",
        "vision_backbone": "resnet_small",
        "dim_model": 32,
        "use_vae": False,
        "n_action_steps": 8,
    }
    settings = json.loads((last_checkpoint(run) / "train_config.json").read_text())
    assert settings["optimizer"]["type"] == "excav_fused_adamw"
    assert settings["scheduler"]["type"] == "cosine_annealing_with_warmup"


def test_training_resumes_where_it_stopped(first_run):
    dataset, run = first_run
    before = MaskACTPolicy.from_pretrained(last_checkpoint(run)).state_dict()
    train(f"--config_path={last_checkpoint(run) / 'train_config.json'}", "--resume=true", "--steps=4")
    state = json.loads((run / "checkpoints" / "last" / "training_state" / "training_step.json").read_text())
    assert state["step"] == 4
    after = MaskACTPolicy.from_pretrained(last_checkpoint(run)).state_dict()
    assert not torch.equal(before["model.action_head.weight"], after["model.action_head.weight"])
    check_checkpoint(last_checkpoint(run), dataset)


def test_fine_tuning_on_another_dataset_keeps_the_mask_unscaled(first_run, second_dataset, tmp_path):
    _, run = first_run
    train(
        f"--policy.path={last_checkpoint(run)}",
        *POLICY,
        "--policy.optimizer_lr=1e-4",
        *dataset_arguments(second_dataset),
        *RUN,
        "--steps=2",
        f"--output_dir={tmp_path / 'tuned'}",
    )
    check_checkpoint(last_checkpoint(tmp_path / "tuned"), second_dataset)
    config = json.loads((last_checkpoint(tmp_path / "tuned") / "config.json").read_text())
    assert (config["optimizer_lr"], config["dim_model"]) == (1e-4, 32)


def test_a_dataset_without_masks_trains_the_no_condition_variant_only(tmp_path):
    dataset = make_dataset(tmp_path / "data", seed=2, cameras=("main",))
    arguments = [*NEW_POLICY, *dataset_arguments(dataset), *RUN, "--steps=1"]
    with pytest.raises(ConfigurationError, match=r"target_mask.*images\.main.*withhold_mask=true"):
        train(*arguments, f"--output_dir={tmp_path / 'refused'}")
    train(*arguments, "--policy.withhold_mask=true", f"--output_dir={tmp_path / 'blind'}")
    assert last_checkpoint(tmp_path / "blind").is_dir()


def test_fine_tuning_on_a_dataset_without_masks_is_refused(first_run, tmp_path):
    _, run = first_run
    dataset = make_dataset(tmp_path / "data", seed=3, cameras=("main", "cab"))
    with pytest.raises(ConfigurationError, match=r"no 'observation.images.target_mask'.*withhold_mask=true"):
        train(
            f"--policy.path={last_checkpoint(run)}",
            *POLICY,
            *dataset_arguments(dataset),
            *RUN,
            "--steps=1",
            f"--output_dir={tmp_path / 'run'}",
        )
