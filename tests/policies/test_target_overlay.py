"""Stock ACT, commanded by a target that is tinted into the main picture."""

import json
from pathlib import Path

import pytest
import torch
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors

from .conftest import HEIGHT, WIDTH, make_dataset, train

pytestmark = pytest.mark.slow

MAIN, CAB, MASK = "observation.images.main", "observation.images.cab", "observation.images.target_mask"
PICTURE = {"type": "VISUAL", "shape": [3, HEIGHT, WIDTH]}
# Without this list LeRobot's policies read every picture of the dataset, the mask among them.
INPUTS = {MAIN: PICTURE, CAB: PICTURE, "observation.state": {"type": "STATE", "shape": [8]}}
TINY = ["dim_model=32", "dim_feedforward=32", "n_encoder_layers=1", "n_vae_encoder_layers=1", "chunk_size=8"]


@pytest.fixture(scope="module")
def dataset(tmp_path_factory) -> Path:
    return make_dataset(tmp_path_factory.mktemp("tinted") / "data", seed=0, tint=True)


@pytest.fixture(scope="module")
def checkpoint(dataset) -> Path:
    options = ["--policy.type=act", f"--policy.input_features={json.dumps(INPUTS)}"]
    options += ["--policy.pretrained_backbone_weights=null", "--policy.n_action_steps=8"]
    options += [f"--policy.{setting}" for setting in TINY]
    return train(dataset, dataset.parent / "run", *options, "--batch_size=2", "--steps=2")


@pytest.fixture
def plan(checkpoint):
    """Plan as lerobot-eval does with the checkpoint."""
    policy = ACTPolicy.from_pretrained(checkpoint)
    preprocess, postprocess = make_pre_post_processors(policy.config, pretrained_path=str(checkpoint))
    return lambda observation: postprocess(policy.predict_action_chunk(preprocess(dict(observation))))


def test_stock_act_trains_on_the_tinted_picture_and_leaves_the_mask_alone(dataset, checkpoint, plan):
    assert list(json.loads((checkpoint / "config.json").read_text())["input_features"]) == list(INPUTS)
    observation = {key: value for key, value in LeRobotDataset("tests/tiny", root=dataset)[0].items() if "obs" in key}
    tinted = plan(observation)
    assert tinted.shape == (1, 8, 4)
    assert torch.isfinite(tinted).all()
    assert torch.equal(plan({**observation, MASK: 1 - observation[MASK]}), tinted)
    del observation[MASK]
    assert torch.equal(plan(observation), tinted)
    elsewhere = observation[MAIN].flip(-1)
    assert not torch.equal(plan({**observation, MAIN: elsewhere}), tinted)
