import inspect

import pytest
import torch
import torchvision

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy

from .conftest import BACKBONES, INPUT_FEATURES, MASK, STATE, stem, visual


def test_the_configuration_is_annotated_with_its_class():
    # LeRobot's own conformance test reads it.
    assert inspect.signature(MaskACTPolicy.__init__).parameters["config"].annotation is MaskACTConfig


def test_a_policy_can_be_built_for_another_camera_and_no_mask(policy):
    features = {"observation.images.laptop": visual(3, 84, 84), STATE: INPUT_FEATURES[STATE]}
    assert policy(input_features=features).config.main_camera_key == "observation.images.laptop"


@pytest.mark.parametrize("backbone", BACKBONES)
def test_a_fresh_policy_equals_its_maskless_twin_bit_for_bit_and_training_wakes_the_mask(policy, batch, backbone):
    agent, blind = policy(vision_backbone=backbone), policy(vision_backbone=backbone, withhold_mask=True)
    observation = batch(actions=True)
    assert torch.equal(agent.predict_action_chunk(observation), blind.predict_action_chunk(observation))
    agent.train().forward(observation)[0].backward()
    assert not stem(agent).weight[:, 3].any()
    assert stem(agent).weight.grad[:, 3].abs().max() > 0


def test_a_fresh_target_token_sees_the_mask_before_the_stem_does(policy, batch, mask):
    agent, observation = policy(target_token=True), batch()
    moved = {**observation, MASK: mask(3, top=0, left=0)}
    assert not torch.equal(agent.predict_action_chunk(observation), agent.predict_action_chunk(moved))


@pytest.mark.parametrize("token", [False, True])
def test_a_seen_mask_moves_the_plan_and_a_withheld_mask_leaves_no_trace_bit_for_bit(awake, batch, mask, token):
    observation, empty = batch(), torch.zeros_like(batch()[MASK])
    others = [{**observation, MASK: other} for other in (mask(3, top=0, left=0), empty, empty + 1)]
    seeing, blind = awake(target_token=token), awake(target_token=token, withhold_mask=True)
    for other in others:
        plan, moved = (seeing.predict_action_chunk(each) for each in (observation, other))
        assert torch.isfinite(moved).all()
        assert (plan - moved).abs().max() > 1e-3
    del others[0][MASK]
    for other in others:
        assert torch.equal(blind.predict_action_chunk(observation), blind.predict_action_chunk(other))


@pytest.mark.parametrize("use_vae", [False, True])
def test_forward_leaves_the_batch_alone_and_every_parameter_gets_a_gradient(policy, batch, use_vae):
    agent = policy(use_vae=use_vae, target_token=True).train()
    data, copy = batch(actions=True), batch(actions=True)
    for each in (data, copy):
        each[MASK][0] = 0.0  # one sample without a target trains the learned token
    agent.forward(data)[0].backward()
    assert data.keys() == copy.keys()
    assert all(torch.equal(data[key], copy[key]) for key in copy)
    assert [name for name, p in agent.named_parameters() if p.grad is None] == []


def test_a_training_step_in_bfloat16_is_close_to_one_in_float32(policy, batch):
    agent, data = (
        policy(target_token=True, use_vae=True, kl_weight=0.0, augment_shift_px=2).train(),
        batch(actions=True),
    )
    losses = []
    for is_enabled in (False, True):
        torch.manual_seed(0)
        with torch.autocast("cpu", torch.bfloat16, enabled=is_enabled):
            losses.append(agent.forward(data)[0])
        agent.zero_grad()
        losses[-1].backward()
        assert all(torch.isfinite(p.grad).all() for p in agent.parameters() if p.grad is not None)
    assert losses[1].dtype == torch.float32
    assert losses[1].item() == pytest.approx(losses[0].item(), rel=0.02)


def test_training_cuts_masks_of_lossy_videos_at_one_half(policy, batch):
    agent, data = policy(target_token=True), batch(actions=True)
    lossy = {**data, MASK: 0.49 + 0.02 * data[MASK]}
    assert torch.equal(agent.forward(lossy)[0], agent.forward(data)[0])


@pytest.mark.parametrize(("use_vae", "weight"), [(False, 10.0), (True, 0.0), (True, 10.0)])
def test_the_loss_is_error_and_weighted_divergence_and_the_mean_over_samples(policy, batch, use_vae, weight):
    agent, data = policy(use_vae=use_vae, kl_weight=weight).train(), batch(actions=True)
    torch.manual_seed(1)
    mean, _ = agent.forward(data)
    torch.manual_seed(1)
    each, parts = agent.forward(data, reduction="none")
    assert each.shape == (3,)
    torch.testing.assert_close(each.mean(), mean)
    assert isinstance(parts["l1_loss"], float)
    divergence = parts["kld_loss"] if use_vae else 0.0
    assert (divergence > 0) == use_vae
    assert mean.item() == pytest.approx(parts["l1_loss"] + weight * divergence, rel=1e-5)
    with pytest.raises(ConfigurationError, match=r"reduction='sum'.*'mean', 'none'"):
        agent.forward(data, reduction="sum")


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


def test_only_a_new_policy_fetches_the_weights_its_backbone_starts_from(tmp_path, policy, monkeypatch):
    agent = policy(vision_backbone="resnet18", backbone_norm="frozen")
    agent.config.pretrained_backbone_weights = "ResNet18_Weights.IMAGENET1K_V1"
    agent.save_pretrained(tmp_path)
    asked, build = [], torchvision.models.resnet18

    def spy(*, weights, **kwargs):
        asked.append(weights)
        return build(weights=None, **kwargs)

    monkeypatch.setattr(torchvision.models, "resnet18", spy)
    config = MaskACTPolicy.from_pretrained(tmp_path).config
    config.pretrained_path = None
    MaskACTPolicy(config)
    assert asked == [None, "ResNet18_Weights.IMAGENET1K_V1"]
