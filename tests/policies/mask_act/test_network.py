import pytest
import torch
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy
from torch import nn

MAIN, CAB, MASK = "observation.images.main", "observation.images.cab", "observation.images.target_mask"

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
]


def from_act(weights):
    """Translate the weights of LeRobot's ACT."""
    ours = {}
    for key, value in weights.items():
        for theirs, name in NAMES:
            if key.startswith(theirs):
                key = name + key.removeprefix(theirs)
                break
        ours[key] = value
    ours["action_encoder.pos_embed"] = ours["action_encoder.pos_embed"].transpose(0, 1)
    stem = ours["backbone.stages.conv1.weight"]
    ours["backbone.stages.conv1.weight"] = torch.cat([stem, torch.zeros_like(stem[:, :1])], dim=1)
    return ours


@pytest.mark.parametrize("training", [False, True])
def test_paper_network_with_the_weights_of_lerobots_act_is_lerobots_act(config, policy, batch, training):
    settings = {"dim_model": 32, "dim_feedforward": 48, "n_heads": 4, "n_encoder_layers": 2, "chunk_size": 8}
    agent = policy(preset="paper", backbone_norm="frozen", dropout=0.0, **settings)
    features = agent.config.input_features
    stock = ACTPolicy(
        ACTConfig(
            **settings,
            n_action_steps=8,
            dropout=0.0,
            device="cpu",
            pretrained_backbone_weights=None,
            input_features={key: feature for key, feature in features.items() if key != MASK},
            output_features=agent.config.output_features,
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
    torch.testing.assert_close(
        agent.predict_action_chunk(data), stock.predict_action_chunk(data), rtol=1e-4, atol=1e-4
    )


@pytest.mark.parametrize("per_token", [1, 2, 8])
def test_one_query_predicts_actions_per_token_actions(policy, batch, per_token):
    agent = policy(actions_per_token=per_token)
    queries = []
    agent.model.decoder.register_forward_pre_hook(lambda _, args: queries.append(args[0].shape[0]))
    plan = agent.predict_action_chunk(batch())
    assert queries == [8 // per_token]
    assert plan.shape == (3, 8, 4)


def test_consecutive_actions_share_a_query(policy, batch):
    agent = policy(actions_per_token=4)
    before = agent.predict_action_chunk(batch())
    with torch.no_grad():
        agent.model.query_embed.weight[1] += 1.0
        agent.model.decoder.layers[
            0
        ].self_attn.out_proj.weight.zero_()  # queries no longer talk to each other
    after = agent.predict_action_chunk(batch())
    with torch.no_grad():
        agent.model.query_embed.weight[0] += 1.0
    last = agent.predict_action_chunk(batch())
    assert before.shape == after.shape
    assert torch.equal(after[:, 4:], last[:, 4:])
    assert (after[:, :4] != last[:, :4]).any()


@pytest.mark.parametrize(
    ("settings", "tokens"),
    [
        ({}, 1 + 1 + 2 * 6),
        ({"target_token": True}, 1 + 1 + 2 * 6 + 1),
        ({"vision_backbone": "resnet18"}, 2 + 2 * 2),
    ],
)
def test_token_count(policy, batch, settings, tokens):
    agent, seen = policy(**settings), []
    agent.model.encoder.register_forward_pre_hook(lambda _, args: seen.append(args[0].shape))
    agent.predict_action_chunk(batch())
    assert seen == [(tokens, 3, 32)]


def test_views_of_two_sizes_pass_one_by_one(policy, batch):
    features = dict(policy().config.input_features)
    features[CAB] = PolicyFeature(type=FeatureType.VISUAL, shape=(3, 16, 32))
    data = batch()
    data[CAB] = data[CAB][..., :16, :32]
    assert policy(input_features=features).predict_action_chunk(data).shape == (3, 8, 4)


def test_a_policy_without_state_and_one_with_environment_state(policy, batch):
    data = batch(actions=True)
    features = {
        key: value for key, value in policy().config.input_features.items() if key != "observation.state"
    }
    assert torch.isfinite(policy(input_features=features, use_vae=True).train().forward(data)[0])
    features["observation.environment_state"] = PolicyFeature(type=FeatureType.ENV, shape=(5,))
    agent = policy(input_features=features)
    plans = [
        agent.predict_action_chunk({**data, "observation.environment_state": torch.full((3, 5), x)})
        for x in (0.0, 1.0)
    ]
    assert not torch.equal(*plans)


@pytest.mark.parametrize("backbone", ["resnet_small", "resnet18"])
def test_backbone_norm_learns_or_stays(policy, backbone):
    learned = policy(vision_backbone=backbone, backbone_norm="batch")
    frozen = policy(vision_backbone=backbone, backbone_norm="frozen")
    assert any(isinstance(m, nn.BatchNorm2d) for m in learned.modules())
    assert not any(isinstance(m, nn.BatchNorm2d) for m in frozen.modules())
    assert len(list(learned.parameters())) > len(list(frozen.parameters()))


@pytest.mark.parametrize(("norm", "moves"), [("batch", True), ("frozen", False)])
def test_backbone_norm_averages_statistics_in_training_or_never(policy, batch, norm, moves):
    agent = policy(backbone_norm=norm).train()
    before = {name: value.clone() for name, value in agent.named_buffers() if "running" in name}
    agent.forward(batch(actions=True))
    after = dict(agent.named_buffers())
    assert before
    assert all((not torch.equal(value, after[name])) == moves for name, value in before.items())


@pytest.mark.parametrize(
    "settings",
    [
        {"dim_model": 64},
        {"dim_feedforward": 64},
        {"n_encoder_layers": 2},
        {"n_decoder_layers": 2},
        {"pre_norm": False},
        {"use_vae": True},
        {"vision_backbone": "resnet18"},
    ],
)
def test_network_settings_change_the_network(policy, settings):
    def shapes(agent):
        return {name: tuple(value.shape) for name, value in agent.state_dict().items()}

    assert shapes(policy()) != shapes(policy(**settings))


def test_dropout_acts_in_training_only(policy, batch):
    agent, data = policy(dropout=0.5), batch(actions=True)
    agent.train()
    assert agent.forward(data)[0].item() != agent.forward(data)[0].item()
    agent.eval()
    assert agent.forward(data)[0].item() == agent.forward(data)[0].item()
