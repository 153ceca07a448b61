import json
from dataclasses import fields, replace

import draccus
import pytest
import torch
from lerobot.configs import PreTrainedConfig
from lerobot.optim import AdamWConfig
from lerobot.policies.act.configuration_act import ACTConfig

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.fused_adamw import FusedAdamWConfig
from lerobot_excav.policies.mask_act.presets import PRESETS

from .conftest import CAB, MAIN, MASK, visual

PICTURE, MASKED = visual(3, 32, 48), {"withhold_mask": False, "target_token": False}


def test_default_is_the_paper_network_and_needs_no_download():
    expected = {"preset": "paper", "pretrained_backbone_weights": None, "chunk_size": 100, "kl_weight": 10.0, **MASKED}
    assert {name: getattr(MaskACTConfig(device="cpu"), name) for name in expected} == expected


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_fills_every_field_that_is_left_open(name):
    config = MaskACTConfig(preset=name, device="cpu")
    optional = {"main_camera", "temporal_ensemble_coeff", "pretrained_backbone_weights", "crop", "resize_to"}
    own = {f.name for f in fields(MaskACTConfig)} - {f.name for f in fields(PreTrainedConfig)}
    assert {f for f in own if getattr(config, f) is None} <= optional
    assert {f: getattr(config, f) for f in PRESETS[name]} == PRESETS[name]
    assert PRESETS[name].keys() == PRESETS["paper"].keys()


def test_a_filled_configuration_does_not_change_its_preset():
    with pytest.raises(ConfigurationError, match=r"preset='paper'.*preset='fast'.*--policy.optimizer_lr"):
        replace(MaskACTConfig(preset="fast", device="cpu"), preset="paper")


def test_configuration_survives_its_file_and_takes_overrides(tmp_path, config):
    config(withhold_mask=True, n_action_steps=4).save_pretrained(tmp_path)
    overrides = ["--withhold_mask=false", "--dropout=0.2", f"--main_camera={CAB}"]
    loaded = PreTrainedConfig.from_pretrained(tmp_path, cli_overrides=overrides)
    assert (loaded.withhold_mask, loaded.dropout, loaded.main_camera) == (False, 0.2, CAB)
    assert (loaded.n_action_steps, loaded.dim_model) == (4, config().dim_model)
    assert json.loads((tmp_path / "config.json").read_text())["type"] == "mask_act"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"preset": "quick"}, r"policy.preset='quick' is not possible; give one of paper, fast"),
        ({"actions_per_token": 3}, r"actions_per_token=3 must divide chunk_size=8.*1, 2, 4, 8"),
        ({"n_action_steps": 9}, r"n_action_steps=9.*chunk_size=8"),
        ({"n_action_steps": 0}, r"n_action_steps=0"),
        ({"temporal_ensemble_coeff": -1.0, "chunk_size": 100}, r"temporal_ensemble_coeff=-1.0 .*give -0.808 or more"),
        ({"output_features": {}}, r"output_features=\[\] lacks 'action'"),
        ({"temporal_ensemble_coeff": 0.01, "n_action_steps": 2}, r"n_action_steps=2 must be 1"),
        ({"dim_model": 30}, r"dim_model=30.*n_heads=4"),
        ({"backbone_norm": "group"}, r"backbone_norm='group'.*batch, frozen"),
        ({"vision_backbone": "vit_b_16"}, r"vision_backbone='vit_b_16'.*resnet_small"),
        ({"pretrained_backbone_weights": "DEFAULT"}, r"pretrained_backbone_weights='DEFAULT'.*resnet18"),
        ({"vision_backbone": "resnet18", "pretrained_backbone_weights": "BEST"}, r"'BEST'.*ResNet18_Weights.IMAGENET"),
        ({"replace_final_stride_with_dilation": True}, r"replace_final_stride_with_dilation=true.*resnet_small.*50"),
        (
            {"replace_final_stride_with_dilation": True, "vision_backbone": "resnet18"},
            r"for vision_backbone='resnet18'",
        ),
        ({"lr_schedule": "linear"}, r"lr_schedule='linear'.*constant, cosine"),
        ({"lr_warmup_steps": -1}, r"lr_warmup_steps=-1"),
        ({"optimizer_lr": 0.0}, r"optimizer_lr=0.0"),
        ({"optimizer_lr_backbone": -1.0}, r"optimizer_lr_backbone=-1.0"),
        ({"dropout": 1.0}, r"dropout=1.0"),
        ({"input_features": {MASK: PICTURE}}, r"needs a camera.*target_mask"),
        ({"main_camera": "observation.images.top"}, r"images.top.*images.main"),
        ({"main_camera": MASK}, r"is the mask itself.*images.main"),
        ({"input_features": {MAIN: visual(1, 32, 48)}}, r"images.main has 1 channel"),
        ({"input_features": {MAIN: PICTURE, MASK: visual(3, 16, 48)}}, r"mask .*\(3, 16, 48\).*main .*\(3, 32, 48\)"),
    ],
)
def test_a_setting_or_feature_that_does_not_fit_is_refused_by_name(config, settings, message):
    with pytest.raises(ConfigurationError, match=message):
        config(**settings).validate_features()


def test_the_command_line_says_which_setting_is_bad(capsys):
    with pytest.raises((SystemExit, draccus.utils.ParsingError, ConfigurationError)) as caught:
        draccus.parse(MaskACTConfig, args=["--preset=quick"])
    said = f"{caught.value} {capsys.readouterr().err}"
    assert "policy.preset='quick' is not possible; give one of paper, fast." in said


def test_open_settings_follow_from_others(config):
    assert config().n_action_steps == 8
    assert config(temporal_ensemble_coeff=0.01).n_action_steps == 1
    weights = {"vision_backbone": "resnet18", "pretrained_backbone_weights": "ResNet18_Weights.IMAGENET1K_V1"}
    assert (config().backbone_norm, config(**weights).backbone_norm) == ("batch", "frozen")
    features = dict.fromkeys((MASK, CAB, MAIN), PICTURE)
    assert config(input_features=features, mask_key=CAB).camera_keys == [MASK, MAIN]


WRIST, TOP = "observation.images.wrist", "observation.images.top"
SMALL = visual(3, 16, 24)


@pytest.mark.parametrize(
    ("features", "settings", "camera"),
    [
        ({MASK: PICTURE, CAB: PICTURE, MAIN: PICTURE}, {}, MAIN),
        ({MASK: PICTURE, CAB: PICTURE, MAIN: PICTURE}, {"main_camera": CAB}, CAB),
        ({WRIST: SMALL, TOP: PICTURE, MASK: PICTURE}, {}, TOP),
        ({WRIST: PICTURE}, {}, WRIST),
        ({WRIST: PICTURE, TOP: PICTURE, MASK: PICTURE}, {"withhold_mask": True}, WRIST),
    ],
)
def test_the_mask_belongs_to_the_camera_that_is_called_main_or_alone_has_its_size(config, features, settings, camera):
    built = config(input_features=features, **settings)
    built.validate_features()
    assert built.main_camera_key == camera


@pytest.mark.parametrize("features", [{WRIST: PICTURE, TOP: PICTURE, MASK: PICTURE}, {WRIST: SMALL, TOP: PICTURE}])
def test_two_cameras_that_the_mask_may_belong_to_are_asked_about(config, features):
    with pytest.raises(ConfigurationError, match=r"may belong to .*wrist or .*top.*--policy\.main_camera="):
        config(input_features=features).validate_features()


def test_a_preset_that_has_nothing_to_decide_is_refused_and_never_recorded():
    acts_own = {**vars(ACTConfig(device="cpu", pretrained_backbone_weights=None))}
    with pytest.raises(ConfigurationError, match=r"preset='fast' has nothing left to decide.*dim_model=512"):
        MaskACTConfig(**acts_own, preset="fast")
    plain = MaskACTConfig(**acts_own)
    assert (plain.preset, plain.preset_applied, plain.dim_model) == (None, None, 512)
    assert (replace(plain).preset_applied, MaskACTConfig(**acts_own, preset="paper").preset_applied) == (None, "paper")
    with pytest.raises(ConfigurationError, match=r"preset='fast' has nothing left to decide"):
        replace(plain, preset="fast")


@pytest.mark.parametrize(
    ("settings", "kind", "warmup"),
    [
        ({}, None, 0),
        ({"lr_warmup_steps": 10}, "constant_with_warmup", 10),
        ({"lr_schedule": "cosine", "lr_warmup_steps": 10}, "cosine_annealing_with_warmup", 10),
    ],
)
def test_learning_rate_schedules(settings, kind, warmup):
    schedule = MaskACTConfig(device="cpu", **settings).get_scheduler_preset()
    assert (schedule and schedule.type) == kind
    assert schedule is None or schedule.num_warmup_steps == warmup


@pytest.mark.parametrize("fused", [True, False])
def test_optimizer_settings_reach_the_optimizer(policy, fused):
    rates = {"optimizer_lr": 0.1, "optimizer_lr_backbone": 0.2, "optimizer_weight_decay": 0.3}
    agent = policy(optimizer_fused=fused, **rates)
    optimizer = agent.config.get_optimizer_preset().build(agent.get_optim_params())
    rest, backbone = optimizer.param_groups
    assert (rest["lr"], backbone["lr"], rest["weight_decay"]) == (0.1, 0.2, 0.3)
    assert bool(rest["fused"]) == fused
    counted = sum(len(group["params"]) for group in optimizer.param_groups)
    assert counted == sum(p.requires_grad for p in agent.parameters())


def test_the_fused_update_is_that_of_lerobots_adamw():
    start, results = torch.randn(7, 5, generator=torch.Generator().manual_seed(0)), []
    for kind in (AdamWConfig, FusedAdamWConfig):
        parameter = torch.nn.Parameter(start.clone())
        optimizer = kind(lr=1e-2, weight_decay=0.1).build([parameter])
        gradients = torch.Generator().manual_seed(1)
        for _ in range(5):
            parameter.grad = torch.randn(7, 5, generator=gradients)
            optimizer.step()
        results.append(parameter.detach())
    torch.testing.assert_close(*results, rtol=1e-5, atol=1e-6)
