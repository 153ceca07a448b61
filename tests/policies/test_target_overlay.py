"""Stock ACT, commanded by a target that is tinted into the main picture."""

import json

import pytest
import torch
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors

from lerobot_excav.envs.masks.overlay import OUTLINE_RGB

from .conftest import train

pytestmark = pytest.mark.slow

MAIN, NEAR, MASK = "observation.images.main", "observation.images.near", "observation.images.target_mask"
PICTURE = {"type": "VISUAL", "shape": [3, 32, 48]}
# Without this list LeRobot's policies read every picture of the dataset, the mask among them.
INPUTS = {MAIN: PICTURE, NEAR: PICTURE, "observation.state": {"type": "STATE", "shape": [2]}}
TINY = ["dim_model=32", "dim_feedforward=32", "n_encoder_layers=1", "n_vae_encoder_layers=1", "chunk_size=8"]


@pytest.fixture(scope="module")
def checkpoint(dataset, tmp_path_factory):
    options = ["--policy.type=act", f"--policy.input_features={json.dumps(INPUTS)}"]
    options += ["--policy.pretrained_backbone_weights=null", "--policy.n_action_steps=8"]
    options += [f"--policy.{setting}" for setting in TINY]
    return train(dataset, tmp_path_factory.mktemp("act") / "run", *options, "--batch_size=2", "--steps=2")


@pytest.fixture
def plan(checkpoint):
    """Plan as lerobot-eval does with the checkpoint."""
    policy = ACTPolicy.from_pretrained(checkpoint)
    preprocess, postprocess = make_pre_post_processors(policy.config, pretrained_path=str(checkpoint))
    return lambda observation: postprocess(policy.predict_action_chunk(preprocess(dict(observation))))


def test_stock_act_trains_on_the_tinted_picture_and_leaves_the_mask_alone(dataset, checkpoint, plan):
    assert list(json.loads((checkpoint / "config.json").read_text())["input_features"]) == list(INPUTS)
    observation = {key: value for key, value in LeRobotDataset("tests/tiny", root=dataset)[0].items() if "obs" in key}
    outline = (observation[MAIN] * 255 == torch.tensor(OUTLINE_RGB)[:, None, None]).all(dim=0)
    assert outline.any()
    assert not observation[MASK][0, outline].any()
    tinted = plan(observation)
    assert tinted.shape == (1, 8, 2)
    assert torch.isfinite(tinted).all()
    assert torch.equal(plan({**observation, MASK: 1 - observation[MASK]}), tinted)
    del observation[MASK]
    assert torch.equal(plan(observation), tinted)
    assert not torch.equal(plan({**observation, MAIN: observation[MAIN].flip(-1)}), tinted)
