import json
from dataclasses import fields, replace

import draccus
import pytest
from lerobot.configs import PreTrainedConfig
from lerobot.configs.types import FeatureType, PolicyFeature

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.presets import PRESETS

MAIN, CAB, MASK = "observation.images.main", "observation.images.cab", "observation.images.target_mask"


def visual(*shape):
    return PolicyFeature(type=FeatureType.VISUAL, shape=shape)


def test_mask_act_is_registered_with_lerobot():
    assert PreTrainedConfig.get_choice_class("mask_act") is MaskACTConfig


def test_default_is_the_paper_network_and_needs_no_download():
    config = MaskACTConfig(device="cpu")
    paper = (
        config.vision_backbone,
        config.chunk_size,
        config.kl_weight,
        config.dim_model,
        config.dim_feedforward,
    )
    assert paper == ("resnet18", 100, 10.0, 512, 3200)
    assert config.pretrained_backbone_weights is None
    assert not config.withhold_mask
    assert not config.target_token


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_fills_every_field_that_is_left_open(name):
    config = MaskACTConfig(preset=name, device="cpu")
    open_fields = {"main_camera"}  # inferred from the features
    own = {f.name for f in fields(MaskACTConfig)} - {f.name for f in fields(PreTrainedConfig)}
    optional = {"temporal_ensemble_coeff", "pretrained_backbone_weights"}
    assert {f for f in own if getattr(config, f) is None} <= open_fields | optional
    assert {f: getattr(config, f) for f in PRESETS[name]} == PRESETS[name]


def test_presets_decide_the_same_fields():
    assert len({frozenset(preset) for preset in PRESETS.values()}) == 1


def test_a_field_set_by_hand_wins_over_the_preset():
    config = MaskACTConfig(preset="fast", dim_model=128, use_vae=True, device="cpu")
    assert (config.dim_model, config.use_vae) == (128, True)
    assert config.actions_per_token == PRESETS["fast"]["actions_per_token"]


def test_a_filled_configuration_does_not_change_its_preset():
    with pytest.raises(ConfigurationError, match=r"preset='paper'.*preset='fast'.*--policy.optimizer_lr"):
        replace(MaskACTConfig(preset="fast", device="cpu"), preset="paper")


def test_configuration_survives_its_file_and_takes_overrides(tmp_path, config):
    config(withhold_mask=True, n_action_steps=4).save_pretrained(tmp_path)
    loaded = PreTrainedConfig.from_pretrained(
        tmp_path, cli_overrides=["--withhold_mask=false", "--dropout=0.2"]
    )
    assert (loaded.withhold_mask, loaded.dropout, loaded.n_action_steps) == (False, 0.2, 4)
    assert loaded.dim_model == config().dim_model
    assert json.loads((tmp_path / "config.json").read_text())["type"] == "mask_act"


def test_command_line_decodes_every_kind_of_field():
    args = ["--preset=fast", "--target_token=true", "--main_camera=observation.images.cab", "--dim_model=64"]
    config = draccus.parse(MaskACTConfig, args=args)
    assert (config.preset, config.target_token, config.main_camera, config.dim_model) == (
        "fast",
        True,
        "observation.images.cab",
        64,
    )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"preset": "quick"}, r"preset='quick'.*'paper', 'fast'"),
        ({"actions_per_token": 3}, r"actions_per_token=3 must divide chunk_size=8.*1, 2, 4, 8"),
        ({"n_action_steps": 9}, r"n_action_steps=9.*chunk_size=8"),
        ({"n_action_steps": 0}, r"n_action_steps=0"),
        ({"temporal_ensemble_coeff": 0.01, "n_action_steps": 2}, r"n_action_steps=2 must be 1"),
        ({"dim_model": 30}, r"dim_model=30.*n_heads=4"),
        ({"backbone_norm": "group"}, r"backbone_norm='group'.*'batch', 'frozen'"),
        ({"vision_backbone": "vit_b_16"}, r"vision_backbone='vit_b_16'.*resnet_small"),
        ({"pretrained_backbone_weights": "DEFAULT"}, r"pretrained_backbone_weights='DEFAULT'.*resnet18"),
        ({"replace_final_stride_with_dilation": True}, r"replace_final_stride_with_dilation"),
        ({"lr_schedule": "linear"}, r"lr_schedule='linear'.*'constant', 'cosine'"),
        ({"lr_warmup_steps": -1}, r"lr_warmup_steps=-1"),
        ({"optimizer_lr": 0.0}, r"optimizer_lr=0.0"),
        ({"optimizer_lr_backbone": -1.0}, r"optimizer_lr_backbone=-1.0"),
        ({"dropout": 1.0}, r"dropout=1.0"),
    ],
)
def test_a_bad_setting_is_refused_by_name(config, settings, message):
    with pytest.raises(ConfigurationError, match=message):
        config(**settings)


def test_the_command_line_says_which_setting_is_bad(capsys):
    with pytest.raises((SystemExit, draccus.utils.ParsingError, ConfigurationError)) as caught:
        draccus.parse(MaskACTConfig, args=["--preset=quick"])
    said = f"{caught.value} {capsys.readouterr().err}"
    assert "preset='quick' is not known; allowed: 'paper', 'fast'." in said


def test_action_steps_follow_chunk_size_and_ensembling(config):
    assert config().n_action_steps == 8
    assert config(temporal_ensemble_coeff=0.01).n_action_steps == 1


def test_pretrained_weights_freeze_the_norm_and_training_from_scratch_does_not():
    assert MaskACTConfig(device="cpu").backbone_norm == "batch"
    weights = "ResNet18_Weights.IMAGENET1K_V1"
    assert MaskACTConfig(pretrained_backbone_weights=weights, device="cpu").backbone_norm == "frozen"


def test_main_camera_is_the_first_that_is_not_the_mask(config):
    features = {MASK: visual(3, 32, 48), CAB: visual(3, 32, 48), MAIN: visual(3, 32, 48)}
    assert config(input_features=features).main_camera_key == CAB
    assert config(input_features=features, main_camera=MAIN).main_camera_key == MAIN


@pytest.mark.parametrize(
    ("features", "settings", "message"),
    [
        ({MASK: visual(3, 32, 48)}, {}, r"needs a camera.*target_mask"),
        ({MAIN: visual(3, 32, 48)}, {"main_camera": "observation.images.top"}, r"images.top.*images.main"),
        ({MAIN: visual(3, 32, 48)}, {"main_camera": MASK}, r"is the mask itself.*images.main"),
        ({MAIN: visual(1, 32, 48)}, {}, r"images.main has 1 channel"),
        ({MAIN: visual(3, 32, 48), MASK: visual(3, 16, 48)}, {}, r"target_mask is 16 x 48.*main is 32 x 48"),
    ],
)
def test_features_that_do_not_fit_are_refused(config, features, settings, message):
    with pytest.raises(ConfigurationError, match=message):
        config(input_features=features, **settings).validate_features()


def test_mask_key_names_the_mask(config):
    features = {MAIN: visual(3, 32, 48), "observation.images.dig_here": visual(3, 32, 48)}
    assert config(input_features=features, mask_key="observation.images.dig_here").camera_keys == [MAIN]


def test_a_dataset_without_masks_is_refused_unless_the_mask_is_withheld(config):
    features = {MAIN: {"dtype": "video", "shape": (32, 48, 3)}, "action": {"dtype": "float32", "shape": (4,)}}
    with pytest.raises(ConfigurationError, match=r"target_mask.*images\.main.*withhold_mask=true"):
        config().set_dataset_feature_metadata(features)
    config(withhold_mask=True).set_dataset_feature_metadata(features)


def test_learning_rate_schedules():
    def schedule(**settings):
        return MaskACTConfig(device="cpu", **settings).get_scheduler_preset()

    assert schedule() is None
    assert schedule(lr_warmup_steps=10).type == "constant_with_warmup"
    cosine = schedule(lr_schedule="cosine", lr_warmup_steps=10)
    assert (cosine.type, cosine.num_warmup_steps) == ("cosine_annealing_with_warmup", 10)


@pytest.mark.parametrize("fused", [True, False])
def test_optimizer_settings_reach_the_optimizer(policy, fused):
    agent = policy(
        optimizer_fused=fused, optimizer_lr=0.1, optimizer_lr_backbone=0.2, optimizer_weight_decay=0.3
    )
    optimizer = agent.config.get_optimizer_preset().build(agent.get_optim_params())
    rest, backbone = optimizer.param_groups
    assert (rest["lr"], backbone["lr"], rest["weight_decay"]) == (0.1, 0.2, 0.3)
    assert bool(rest["fused"]) == fused
    counted = sum(len(group["params"]) for group in optimizer.param_groups)
    assert counted == sum(p.requires_grad for p in agent.parameters())
