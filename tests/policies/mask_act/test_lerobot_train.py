"""mask_act through the stock `lerobot-train`: train, resume, fine-tune, load."""

import json
import shlex
import sys

import pytest
import torch
from lerobot.datasets.dataset_tools import remove_feature
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.policies.factory import make_pre_post_processors
from lerobot.scripts import lerobot_train

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy
from lerobot_excav.policies.mask_act.training_masks import SAFE_TRANSFORMS

from ..conftest import record, train

pytestmark = pytest.mark.slow

NEW = ["--policy.type=mask_act", "--policy.preset=fast", "--policy.chunk_size=8", "--policy.dim_model=32"]


def settings(checkpoint, file="config.json"):
    return json.loads((checkpoint / file).read_text())


def check_checkpoint(checkpoint, dataset_root):
    """The mask passes unscaled, the pictures do not, and the plan is finite."""
    policy = MaskACTPolicy.from_pretrained(checkpoint)
    preprocess, postprocess = make_pre_post_processors(policy.config, pretrained_path=str(checkpoint))
    item = LeRobotDataset("tests/tiny", root=dataset_root)[0]
    batch = preprocess({key: value for key, value in item.items() if key.startswith("observation.")})
    mask = batch["observation.images.target_mask"]
    assert torch.equal(mask[0], item["observation.images.target_mask"])
    assert mask.unique().tolist() == [0.0, 1.0]
    assert batch["observation.images.main"].min() < -1
    action = postprocess(policy.select_action(batch))
    assert action.shape == (1, 2)
    assert torch.isfinite(action).all()


@pytest.fixture(scope="module")
def checkpoint(dataset, tmp_path_factory):
    """What two steps of training leave."""
    return train(dataset, tmp_path_factory.mktemp("mask_act") / "run", *NEW, "--policy.target_token=true", "--steps=2")


def test_a_trained_checkpoint_loads_and_the_preset_gave_way_to_flags(dataset, checkpoint):
    check_checkpoint(checkpoint, dataset)
    chosen = {"preset": "fast", "vision_backbone": "resnet_small", "dim_model": 32, "n_action_steps": 8}
    assert chosen.items() <= settings(checkpoint).items()
    training = settings(checkpoint, "train_config.json")
    assert training["optimizer"]["type"] == "excav_fused_adamw"
    assert training["scheduler"]["type"] == "cosine_annealing_with_warmup"


def test_training_resumes_where_it_stopped(dataset, checkpoint, monkeypatch):
    before = MaskACTPolicy.from_pretrained(checkpoint).state_dict()
    resume = [f"--config_path={checkpoint / 'train_config.json'}", "--resume=true", "--steps=4"]
    monkeypatch.setattr(sys, "argv", ["lerobot-train", *resume])
    lerobot_train.main()
    assert settings(checkpoint, "../training_state/training_step.json")["step"] == 4
    after = MaskACTPolicy.from_pretrained(checkpoint).state_dict()
    assert not torch.equal(before["model.action_head.weight"], after["model.action_head.weight"])
    check_checkpoint(checkpoint, dataset)


def test_fine_tuning_on_another_dataset_keeps_the_mask_unscaled(checkpoint, tmp_path):
    other = record(tmp_path / "data", table="ice")
    options = [f"--policy.path={checkpoint}", "--policy.optimizer_lr=1e-4", "--steps=2"]
    tuned = train(other, tmp_path / "run", *options)
    check_checkpoint(tuned, other)
    assert {"optimizer_lr": 1e-4, "dim_model": 32}.items() <= settings(tuned).items()


def test_a_dataset_without_masks_trains_the_no_condition_variant_only(dataset, checkpoint, tmp_path):
    unmasked = tmp_path / "data"
    remove_feature(LeRobotDataset("tests/tiny", root=dataset), "observation.images.target_mask", output_dir=unmasked)
    for name, policy in (("new", NEW), ("tuned", [f"--policy.path={checkpoint}"])):
        with pytest.raises(ConfigurationError, match=r"no .*'observation.images.target_mask'.*withhold_mask=true"):
            train(unmasked, tmp_path / name, *policy, "--steps=1")
    assert train(unmasked, tmp_path / "blind", *NEW, "--policy.withhold_mask=true", "--steps=1").is_dir()


def test_transforms_that_part_mask_and_picture_end_training_and_the_named_ones_do_not(dataset, tmp_path):
    moving = ["--dataset.image_transforms.enable=true", "--dataset.image_transforms.max_num_transforms=6"]
    with pytest.raises(ConfigurationError, match="is not the one that the dataset holds") as refusal:
        train(dataset, tmp_path / "moved", *NEW, *moving, "--steps=1")
    assert SAFE_TRANSFORMS in str(refusal.value)
    still = [*shlex.split(SAFE_TRANSFORMS), "--policy.augment_shift_px=2"]
    assert settings(train(dataset, tmp_path / "still", *NEW, *still, "--steps=1"))["augment_shift_px"] == 2
