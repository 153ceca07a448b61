import inspect

import pytest
import torch
import torchvision
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.policies.factory import get_policy_class

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy

MAIN, CAB, MASK = "observation.images.main", "observation.images.cab", "observation.images.target_mask"
BACKBONES = ["resnet_small", "resnet18"]


def test_lerobot_finds_the_policy_by_name():
    assert get_policy_class("mask_act") is MaskACTPolicy
    # LeRobot's own conformance test reads the annotation as a class.
    assert inspect.signature(MaskACTPolicy.__init__).parameters["config"].annotation is MaskACTConfig


def test_a_policy_can_be_built_for_another_camera_and_no_mask():
    laptop = PolicyFeature(type=FeatureType.VISUAL, shape=(3, 84, 84))
    vector = PolicyFeature(type=FeatureType.STATE, shape=(6,))
    config = MaskACTConfig(
        preset="fast",
        device="cpu",
        input_features={"observation.images.laptop": laptop, "observation.state": vector},
        output_features={"action": PolicyFeature(type=FeatureType.ACTION, shape=(6,))},
    )
    assert MaskACTPolicy(config).config.main_camera_key == "observation.images.laptop"


@pytest.mark.parametrize("backbone", BACKBONES)
def test_a_fresh_policy_equals_its_maskless_twin_bit_for_bit(policy, batch, backbone):
    pointed, blind = policy(vision_backbone=backbone), policy(vision_backbone=backbone, withhold_mask=True)
    observation = batch()
    assert torch.equal(pointed.predict_action_chunk(observation), blind.predict_action_chunk(observation))


@pytest.mark.parametrize("backbone", BACKBONES)
def test_training_wakes_the_mask_channel(policy, batch, backbone):
    agent = policy(vision_backbone=backbone).train()
    loss, _ = agent.forward(batch(actions=True))
    loss.backward()
    stem = next(m for m in agent.modules() if isinstance(m, torch.nn.Conv2d))
    assert not stem.weight[:, 3].any()
    assert stem.weight.grad[:, 3].abs().max() > 0


@pytest.mark.parametrize("token", [False, True])
def test_a_withheld_mask_leaves_no_trace_bit_for_bit(awake, batch, mask, token):
    agent = awake(withhold_mask=True, target_token=token)
    observation = batch()
    plan = agent.predict_action_chunk(observation)
    for other in (
        mask(3, top=0, left=0),
        torch.zeros_like(observation[MASK]),
        torch.ones_like(observation[MASK]),
    ):
        assert torch.equal(plan, agent.predict_action_chunk({**observation, MASK: other}))
    del observation[MASK]
    assert torch.equal(plan, agent.predict_action_chunk(observation))


@pytest.mark.parametrize("token", [False, True])
def test_a_seen_mask_moves_the_plan(awake, batch, mask, token):
    agent = awake(target_token=token)
    observation = batch()
    moved = {**observation, MASK: mask(3, top=0, left=0)}
    difference = agent.predict_action_chunk(observation) - agent.predict_action_chunk(moved)
    assert difference.abs().max() > 1e-3


def test_the_target_token_sees_the_mask_before_the_stem_does(policy, batch, mask):
    observation = batch()
    moved = {**observation, MASK: mask(3, top=0, left=0)}
    plain, token = policy(), policy(target_token=True)
    assert torch.equal(plain.predict_action_chunk(observation), plain.predict_action_chunk(moved))
    assert not torch.equal(token.predict_action_chunk(observation), token.predict_action_chunk(moved))


def test_an_empty_mask_gives_a_finite_plan(awake, batch):
    observation = batch()
    observation[MASK] = torch.zeros_like(observation[MASK])
    assert torch.isfinite(awake(target_token=True).predict_action_chunk(observation)).all()


def test_main_camera_decides_which_view_the_mask_joins(awake, batch):
    observation = batch()
    plans = [awake(main_camera=camera).predict_action_chunk(observation) for camera in (MAIN, CAB)]
    assert not torch.allclose(*plans)
    blind = [awake(main_camera=camera, withhold_mask=True) for camera in (MAIN, CAB)]
    assert torch.equal(*(agent.predict_action_chunk(observation) for agent in blind))


@pytest.mark.parametrize("use_vae", [False, True])
def test_forward_leaves_the_batch_alone_and_gives_gradients(policy, batch, use_vae):
    agent = policy(use_vae=use_vae, target_token=True).train()
    data, copy = batch(actions=True), batch(actions=True)
    data[MASK][0] = 0.0
    copy[MASK][0] = 0.0  # one sample without a target trains the learned token
    loss, parts = agent.forward(data)
    loss.backward()
    assert data.keys() == copy.keys()
    assert all(torch.equal(data[key], copy[key]) for key in copy)
    assert ("kld_loss" in parts) == use_vae
    without = [name for name, p in agent.named_parameters() if p.grad is None]
    assert without == []


def test_kl_weight_scales_the_divergence(policy, batch):
    losses = []
    for weight in (0.0, 10.0):
        agent = policy(use_vae=True, kl_weight=weight).train()
        torch.manual_seed(1)
        loss, parts = agent.forward(batch(actions=True))
        assert loss.item() == pytest.approx(parts["l1_loss"] + weight * parts["kld_loss"], rel=1e-5)
        losses.append(loss.item())
    assert losses[1] > losses[0]


@pytest.mark.parametrize("use_vae", [False, True])
def test_losses_per_sample_average_to_the_loss(policy, batch, use_vae):
    agent = policy(use_vae=use_vae).train()
    data = batch(actions=True)
    torch.manual_seed(1)
    mean, _ = agent.forward(data)
    torch.manual_seed(1)
    each, parts = agent.forward(data, reduction="none")
    assert each.shape == (3,)
    torch.testing.assert_close(each.mean(), mean)
    assert isinstance(parts["l1_loss"], float)


def test_an_unknown_reduction_is_refused(policy, batch):
    with pytest.raises(ConfigurationError, match=r"reduction='sum'.*'mean', 'none'"):
        policy().forward(batch(actions=True), reduction="sum")


@pytest.mark.parametrize("reduction", ["mean", "none"])
def test_actions_beyond_the_episode_do_not_count(policy, batch, reduction):
    agent, data = policy(), batch(actions=True)
    data["action_is_pad"][:, 3:] = True
    data["action_is_pad"][2] = True
    loss, _ = agent.forward(data, reduction=reduction)
    data["action"][:, 3:] += 100.0
    data["action"][2] -= 100.0
    assert torch.equal(loss, agent.forward(data, reduction=reduction)[0])
    assert torch.isfinite(loss).all()


def test_a_checkpoint_gives_the_same_plan(tmp_path, awake, batch):
    agent, observation = awake(target_token=True, use_vae=True), batch()
    agent.save_pretrained(tmp_path)
    loaded = MaskACTPolicy.from_pretrained(tmp_path)
    assert torch.equal(loaded.predict_action_chunk(observation), agent.predict_action_chunk(observation))


def test_a_checkpoint_never_fetches_the_weights_its_backbone_started_from(tmp_path, policy, monkeypatch):
    agent = policy(vision_backbone="resnet18", backbone_norm="frozen")
    agent.config.pretrained_backbone_weights = "ResNet18_Weights.IMAGENET1K_V1"
    agent.save_pretrained(tmp_path)
    asked = []
    build = torchvision.models.resnet18

    def spy(*, weights, **kwargs):
        asked.append(weights)
        return build(weights=None, **kwargs)

    monkeypatch.setattr(torchvision.models, "resnet18", spy)
    loaded = MaskACTPolicy.from_pretrained(tmp_path)
    assert asked == [None]
    assert loaded.config.pretrained_backbone_weights == "ResNet18_Weights.IMAGENET1K_V1"
    # A new policy does ask for them.
    loaded.config.pretrained_path = None
    MaskACTPolicy(loaded.config)
    assert asked == [None, "ResNet18_Weights.IMAGENET1K_V1"]
