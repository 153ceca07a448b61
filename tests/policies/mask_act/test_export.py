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

from .conftest import INPUT_FEATURES, OUTPUT_FEATURES, STATE

WEIGHTS = "model.safetensors"


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
    dataset = {"repo_id": "local/x", "root": str(tmp_path)}
    training = {"dataset": dataset, "steps": 9, "batch_size": 4, "seed": 1}
    (folder / "train_config.json").write_text(json.dumps(training))
    return folder


@pytest.fixture
def exported(checkpoint, tmp_path):
    return export_checkpoint(checkpoint, tmp_path / "out" / "small", CardFacts(results="98 of 100"))


def test_the_copy_acts_in_single_precision_as_the_original_rounded_to_half(checkpoint, exported, batch):
    original, copy = (MaskACTPolicy.from_pretrained(folder, strict=True) for folder in (checkpoint, exported))
    assert {value.dtype for value in copy.parameters()} == {torch.float32}
    plan, plan_of_copy = original.predict_action_chunk(batch()), copy.predict_action_chunk(batch())
    torch.testing.assert_close(plan_of_copy, plan, atol=5e-3, rtol=0)
    assert not torch.equal(plan_of_copy, plan)
    with torch.no_grad():
        for parameter in original.parameters():
            parameter.copy_(parameter.half())
    assert torch.equal(plan_of_copy, original.predict_action_chunk(batch()))


def test_the_file_lacks_what_only_training_needs_and_halves_all_but_running_statistics(checkpoint, exported):
    before, after = (load_file(folder / WEIGHTS) for folder in (checkpoint, exported))
    encoder = {name for name in before if name.startswith("model.action_encoder.")}
    assert encoder
    assert before.keys() - after.keys() == encoder
    wide = {name.rsplit(".", 1)[-1] for name, value in after.items() if value.dtype != torch.float16}
    assert wide == {"running_mean", "running_var", "num_batches_tracked"}
    assert (exported / WEIGHTS).stat().st_size < 0.5 * (checkpoint / WEIGHTS).stat().st_size


def test_the_processors_come_along(checkpoint, exported, batch):
    for folder in (checkpoint, exported):
        config = MaskACTPolicy.from_pretrained(folder).config
        preprocess, _ = make_pre_post_processors(config, pretrained_path=str(folder))
        state = preprocess({**batch(1), STATE: torch.full((1, 8), 10.0)})[STATE]
        torch.testing.assert_close(state, torch.full((1, 8), 2.0))  # (10 - 2) / 4


def test_the_card_has_the_facts_and_no_file_names_a_local_path(exported, tmp_path):
    assert "98 of 100" in (exported / "README.md").read_text()
    assert not (exported / "train_config.json").exists()
    for file in exported.iterdir():
        assert str(tmp_path).encode() not in file.read_bytes(), file.name


def test_a_second_export_replaces_the_first_but_not_the_checkpoint(checkpoint, exported):
    before = (exported / WEIGHTS).read_bytes()
    (exported / WEIGHTS).write_bytes(b"")
    export_checkpoint(checkpoint, exported)
    assert (exported / WEIGHTS).read_bytes() == before
    with pytest.raises(ConfigurationError, match="is the checkpoint itself"):
        export_checkpoint(checkpoint, checkpoint)


def test_a_folder_without_a_checkpoint_is_refused(tmp_path):
    with pytest.raises(ConfigurationError, match=r"config\.json and model\.safetensors.*checkpoints/last"):
        export_checkpoint(tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_policy_of_another_type_is_refused(tmp_path):
    features = {"input_features": dict(INPUT_FEATURES), "output_features": dict(OUTPUT_FEATURES)}
    small = {"pretrained_backbone_weights": None, "dim_model": 32, "dim_feedforward": 32, "device": "cpu"}
    ACTPolicy(ACTConfig(**features, **small)).save_pretrained(tmp_path / "act")
    with pytest.raises(ConfigurationError, match="type 'act'; only mask_act"):
        export_checkpoint(tmp_path / "act", tmp_path / "out")


def test_a_diverged_policy_is_refused(policy, tmp_path):
    agent = policy()
    with torch.no_grad():
        agent.model.action_head.weight[0, 0] = 1e5
    agent.save_pretrained(tmp_path / "diverged")
    with pytest.raises(ConfigurationError, match=r"action_head\.weight holds values up to 100000"):
        export_checkpoint(tmp_path / "diverged", tmp_path / "out")
