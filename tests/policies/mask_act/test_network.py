import pytest
import torch
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy

from .conftest import CAB, INPUT_FEATURES, MASK, OUTPUT_FEATURES, STATE, visual

# LeRobot's name -> ours, by prefix; the first that fits.
NAMES = [
    ("vae_encoder_cls_embed", "action_encoder.cls_embed"),
    ("vae_encoder_robot_state_input_proj", "action_encoder.state_proj"),
    ("vae_encoder_action_input_proj", "action_encoder.action_proj"),
    ("vae_encoder_latent_output_proj", "action_encoder.latent_proj"),
    ("vae_encoder_pos_enc", "action_encoder.pos_embed"),
    ("vae_encoder", "action_encoder.encoder"),
    ("backbone", "backbone.stages"),
    ("encoder_img_feat_input_proj", "image_proj"),
    ("encoder_robot_state_input_proj", "state_proj"),
    ("encoder_env_state_input_proj", "env_state_proj"),
    ("encoder_latent_input_proj", "latent_proj"),
    ("encoder_1d_feature_pos_embed", "vector_pos_embed"),
    ("decoder_pos_embed", "query_embed"),
    ("", ""),
]


def from_act(weights):
    """Translate the weights of LeRobot's ACT."""
    ours = {}
    for key, value in weights.items():
        theirs, name = next(pair for pair in NAMES if key.startswith(pair[0]))
        ours[name + key.removeprefix(theirs)] = value
    ours["action_encoder.pos_embed"] = ours["action_encoder.pos_embed"].transpose(0, 1)
    stem = ours["backbone.stages.conv1.weight"]
    ours["backbone.stages.conv1.weight"] = torch.cat([stem, torch.zeros_like(stem[:, :1])], dim=1)
    return ours


@pytest.mark.parametrize("training", [False, True])
def test_paper_network_with_the_weights_of_lerobots_act_is_lerobots_act(policy, batch, training):
    settings = {"dim_model": 32, "dim_feedforward": 48, "n_heads": 4, "n_encoder_layers": 2, "dropout": 0.0}
    agent = policy(preset="paper", backbone_norm="frozen", **settings)
    stock = ACTPolicy(
        ACTConfig(
            **settings,
            chunk_size=8,
            n_action_steps=8,
            device="cpu",
            pretrained_backbone_weights=None,
            input_features={key: feature for key, feature in INPUT_FEATURES.items() if key != MASK},
            output_features=dict(OUTPUT_FEATURES),
        )
    )
    agent.model.load_state_dict(from_act(stock.model.state_dict()), strict=True)
    agent.train(training)
    stock.train(training)
    data = batch(actions=True)
    data["action_is_pad"][0, 5:] = True
    torch.manual_seed(3)
    loss, parts = agent.forward(data)
    torch.manual_seed(3)
    expected, expected_parts = stock.forward(data)
    # Images run through the backbone in another memory layout, so sums are taken in another order.
    torch.testing.assert_close(loss, expected, rtol=1e-4, atol=1e-5)
    assert parts == pytest.approx(expected_parts, rel=1e-4)
    plan, expected_plan = agent.predict_action_chunk(data), stock.predict_action_chunk(data)
    torch.testing.assert_close(plan, expected_plan, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("per_token", [1, 2, 8])
def test_one_query_predicts_actions_per_token_consecutive_actions(policy, batch, per_token):
    agent = policy(actions_per_token=per_token)
    with torch.no_grad():  # queries do not talk to each other
        agent.model.decoder.layers[0].self_attn.out_proj.weight.zero_()
    before = agent.predict_action_chunk(batch())
    with torch.no_grad():
        agent.model.query_embed.weight[0] += 1.0
    after = agent.predict_action_chunk(batch())
    assert len(agent.model.query_embed.weight) == 8 // per_token
    assert (before != after).any(dim=(0, 2)).tolist() == [True] * per_token + [False] * (8 - per_token)


def test_views_of_two_sizes_pass_one_by_one(policy, batch):
    data = batch()
    data[CAB] = data[CAB][..., :16, :32]
    agent = policy(input_features={**INPUT_FEATURES, CAB: visual(3, 16, 32)})
    assert agent.predict_action_chunk(data).shape == (3, 8, 4)


def test_a_policy_without_state_and_one_with_environment_state(policy, batch):
    data = batch(actions=True)
    features = {key: feature for key, feature in INPUT_FEATURES.items() if key != STATE}
    assert torch.isfinite(policy(input_features=features, use_vae=True).train().forward(data)[0])
    environment = "observation.environment_state"
    features[environment] = PolicyFeature(type=FeatureType.ENV, shape=(5,))
    agent = policy(input_features=features)
    plans = [agent.predict_action_chunk({**data, environment: torch.full((3, 5), x)}) for x in (0.0, 1.0)]
    assert not torch.equal(*plans)
