import json

import pytest
import torch
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors
from safetensors.torch import load_file

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.export import export_checkpoint
from lerobot_excav.policies.mask_act.model_card import CardFacts
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy
from lerobot_excav.policies.mask_act.processor_mask_act import make_mask_act_pre_post_processors

from .conftest import INPUT_FEATURES, OUTPUT_FEATURES

STATE = "observation.state"


@pytest.fixture
def checkpoint(awake, batch, tmp_path):
    """What lerobot-train leaves in `pretrained_model`, of a policy with every part that a policy can have."""
    policy = awake(use_vae=True, target_token=True).train()
    for seed in range(3):  # running statistics that are not those of a fresh network
        policy.forward(batch(seed=seed, actions=True))
    folder = tmp_path / "pretrained_model"
    policy.save_pretrained(folder)
    stats = {STATE: {"mean": torch.full((8,), 2.0), "std": torch.full((8,), 4.0)}}
    for pipeline in make_mask_act_pre_post_processors(policy.config, stats):
        pipeline.save_pretrained(folder)
    settings = {
        "dataset": {"repo_id": "local/x", "root": str(tmp_path)},
        "steps": 9,
        "batch_size": 4,
        "seed": 1,
    }
    (folder / "train_config.json").write_text(json.dumps(settings))
    return folder


@pytest.fixture
def exported(checkpoint, tmp_path):
    return export_checkpoint(checkpoint, tmp_path / "out" / "small")


def test_the_copy_acts_as_the_original_rounded_to_half_precision(checkpoint, exported, batch):
    original, copy = MaskACTPolicy.from_pretrained(checkpoint), MaskACTPolicy.from_pretrained(exported)
    plan, plan_of_copy = original.predict_action_chunk(batch()), copy.predict_action_chunk(batch())
    torch.testing.assert_close(plan_of_copy, plan, atol=5e-3, rtol=0)
    assert not torch.equal(plan_of_copy, plan)
    with torch.no_grad():
        for parameter in original.parameters():
            parameter.copy_(parameter.half())
    assert torch.equal(plan_of_copy, original.predict_action_chunk(batch()))


def test_the_copy_computes_in_single_precision(exported):
    assert {value.dtype for value in MaskACTPolicy.from_pretrained(exported).parameters()} == {torch.float32}


def test_the_file_holds_half_precision_but_for_running_statistics(exported):
    weights = load_file(exported / "model.safetensors")
    assert weights["model.action_head.weight"].dtype == torch.float16
    wide = {name.rsplit(".", 1)[-1] for name, value in weights.items() if value.dtype != torch.float16}
    assert wide == {"running_mean", "running_var", "num_batches_tracked"}


def test_what_only_training_needs_stays_behind(checkpoint, exported):
    before, after = (load_file(folder / "model.safetensors") for folder in (checkpoint, exported))
    assert (
        {name for name in before if name not in after}
        == {name for name in before if name.startswith("model.action_encoder.")}
        != set()
    )
    assert MaskACTPolicy.from_pretrained(exported).model.action_encoder is None
    assert not (exported / "train_config.json").exists()


def test_nothing_is_missing_or_left_over_when_the_copy_is_loaded(exported):
    MaskACTPolicy.from_pretrained(exported, strict=True)


def test_the_copy_is_less_than_half_as_large(checkpoint, exported):
    sizes = [(folder / "model.safetensors").stat().st_size for folder in (checkpoint, exported)]
    assert sizes[1] < 0.5 * sizes[0]


def test_the_processors_come_along(checkpoint, exported, batch):
    observation = {STATE: torch.full((1, 8), 10.0)}
    outputs = []
    for folder in (checkpoint, exported):
        config = MaskACTPolicy.from_pretrained(folder).config
        preprocess, _ = make_pre_post_processors(config, pretrained_path=str(folder))
        outputs.append(preprocess({**batch(1), **observation})[STATE])
    assert torch.equal(*outputs)
    torch.testing.assert_close(outputs[1], torch.full((1, 8), 2.0))  # (10 - 2) / 4


def test_no_file_of_the_copy_names_a_local_path(exported, tmp_path):
    for file in exported.iterdir():
        assert str(tmp_path).encode() not in file.read_bytes(), file.name


def test_the_facts_reach_the_card(checkpoint, tmp_path):
    out = export_checkpoint(checkpoint, tmp_path / "small", CardFacts(results="98 of 100"))
    assert "98 of 100" in (out / "README.md").read_text()


def test_a_second_export_replaces_the_first(checkpoint, exported):
    before = (exported / "model.safetensors").read_bytes()
    (exported / "model.safetensors").write_bytes(b"")
    export_checkpoint(checkpoint, exported)
    assert (exported / "model.safetensors").read_bytes() == before


def test_the_checkpoint_itself_is_not_overwritten(checkpoint):
    with pytest.raises(ConfigurationError, match="is the checkpoint itself"):
        export_checkpoint(checkpoint, checkpoint)


def test_a_folder_without_a_checkpoint_is_refused(tmp_path):
    with pytest.raises(
        ConfigurationError, match=r"no config\.json and no model\.safetensors.*checkpoints/last"
    ):
        export_checkpoint(tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_policy_of_another_type_is_refused(tmp_path):
    config = ACTConfig(
        input_features=dict(INPUT_FEATURES),
        output_features=dict(OUTPUT_FEATURES),
        pretrained_backbone_weights=None,
        dim_model=32,
        dim_feedforward=32,
        device="cpu",
    )
    ACTPolicy(config).save_pretrained(tmp_path / "act")
    with pytest.raises(ConfigurationError, match="type 'act'; only mask_act"):
        export_checkpoint(tmp_path / "act", tmp_path / "out")


def test_a_diverged_policy_is_refused(policy, tmp_path):
    agent = policy()
    with torch.no_grad():
        agent.model.action_head.weight[0, 0] = 1e5
    agent.save_pretrained(tmp_path / "diverged")
    with pytest.raises(ConfigurationError, match=r"action_head\.weight holds values up to 100000"):
        export_checkpoint(tmp_path / "diverged", tmp_path / "out")
