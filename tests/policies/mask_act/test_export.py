import json
import re
from functools import wraps
from unittest.mock import Mock

import pytest
import torch
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act import export
from lerobot_excav.policies.mask_act.checkpoint import read_tensors
from lerobot_excav.policies.mask_act.export import export_checkpoint
from lerobot_excav.policies.mask_act.model_card import CardFacts
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy
from lerobot_excav.policies.mask_act.processor_mask_act import make_mask_act_pre_post_processors

from .conftest import CAB, INPUT_FEATURES, MAIN, OUTPUT_FEATURES, STATE

WEIGHTS, ACTION = "model.safetensors", "action"
STATISTICS = "policy_preprocessor_step_3_normalizer_processor.safetensors"


@pytest.fixture
def checkpoint(awake, batch, tmp_path):
    """What lerobot-train leaves in `pretrained_model`, of a policy with every part that a policy can have."""
    policy = awake(use_vae=True, target_token=True).train()
    for seed in range(3):  # running statistics that are not those of a fresh network
        policy.forward(batch(seed=seed, actions=True))
    folder = tmp_path / "pretrained_model"
    policy.save_pretrained(folder)
    stats = {
        STATE: {"mean": torch.full((8,), 2.0), "std": torch.full((8,), 4.0)},
        ACTION: {"mean": torch.zeros(4), "std": torch.ones(4)},
        **{camera: {"mean": torch.zeros(3, 1, 1), "std": torch.ones(3, 1, 1)} for camera in (MAIN, CAB)},
    }
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


def test_an_export_stands_in_a_folder_of_its_own(checkpoint, exported):
    for folder in (exported, checkpoint):
        before = {path.name: path.read_bytes() for path in folder.iterdir()}
        with pytest.raises(ConfigurationError, match=rf"out={folder} exists; choose another"):
            export_checkpoint(checkpoint, folder)
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize("kind", [torch.float8_e4m3fn, torch.float8_e5m2])
def test_weights_in_eight_bits_are_read(tmp_path, kind):
    save_file({"a": torch.tensor([0.5, -2.0]).to(kind)}, tmp_path / WEIGHTS)
    assert read_tensors(tmp_path / WEIGHTS)["a"].float().tolist() == [0.5, -2.0]
    save_file({"a": torch.tensor([0.5, torch.nan]).to(kind)}, tmp_path / WEIGHTS)
    with pytest.raises(ConfigurationError, match="a holds numbers that are not finite"):
        read_tensors(tmp_path / WEIGHTS)


def test_an_export_that_fails_leaves_nothing(checkpoint, tmp_path, monkeypatch):
    (tmp_path / "out").mkdir()  # empty, so it may become the export
    with monkeypatch.context() as patch:
        patch.setattr(export, "save_file", Mock(side_effect=SafetensorError("No space left (os error 28)")))
        with pytest.raises(ConfigurationError, match=r"out=\S*out cannot be written: No space left .* free some space"):
            export_checkpoint(checkpoint, tmp_path / "out")
    assert not list(tmp_path.glob(".*"))
    assert (export_checkpoint(checkpoint, tmp_path / "out") / WEIGHTS).is_file()


def change_tensors(change):
    @wraps(change)
    def damage(file):
        tensors = load_file(file)
        change(tensors)
        save_file(tensors, file)

    return damage


def change_settings(change):
    @wraps(change)
    def damage(file):
        content = json.loads(file.read_text())
        change(content)
        file.write_text(json.dumps(content))

    return damage


@change_tensors
def without_weights(tensors):
    for name in [name for name in tensors if name.endswith(".weight")]:
        del tensors[name]


@change_tensors
def with_another(tensors):
    tensors["model.extra.weight"] = torch.zeros(2)


@change_tensors
def misshaped(tensors):
    tensors["model.action_head.bias"] = torch.zeros(3)


@change_tensors
def of_whole_numbers(tensors):
    tensors["model.action_head.bias"] = tensors["model.action_head.bias"].int()


@change_tensors
def not_a_number(tensors):
    next(value for value in tensors.values() if value.is_floating_point()).view(-1)[0] = torch.nan


@change_tensors
def without_means(tensors):
    for name in [name for name in tensors if name.endswith(".mean")]:
        del tensors[name]


@change_tensors
def of_another_robot(tensors):
    tensors["observation.state.mean"] = torch.zeros(5)


@change_settings
def without_steps(content):
    content["steps"] = []


def truncated(file):
    file.write_bytes(file.read_bytes()[:-5])


def emptied(file):
    file.write_bytes(b"")


def turned_to_noise(file):
    file.write_bytes(bytes(range(256)))


def removed(file):
    file.unlink()


BROKEN_FILES = [(d, name) for d in (truncated, emptied, turned_to_noise) for name in (WEIGHTS, STATISTICS)]
DAMAGES = [
    *BROKEN_FILES,
    *[(without_weights, WEIGHTS), (with_another, WEIGHTS), (misshaped, WEIGHTS), (of_whole_numbers, WEIGHTS)],
    *[(not_a_number, WEIGHTS), (not_a_number, STATISTICS), (removed, STATISTICS), (without_means, STATISTICS)],
    *[(of_another_robot, STATISTICS), (without_steps, "policy_postprocessor.json")],
    *[(d, "policy_preprocessor.json") for d in (truncated, emptied, turned_to_noise, removed)],
]


@pytest.mark.parametrize(("damage", "name"), DAMAGES, ids=lambda value: getattr(value, "__name__", value))
def test_a_damaged_file_is_named_and_neither_exported_nor_run(checkpoint, tmp_path, damage, name):
    damage(checkpoint / name)
    with pytest.raises(ConfigurationError, match=re.escape(name)):
        export_checkpoint(checkpoint, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    with pytest.raises(ConfigurationError, match=re.escape(name)):
        MaskACTPolicy.from_pretrained(checkpoint)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (truncated, "cannot be read"),
        (turned_to_noise, "cannot be read"),
        (change_settings(lambda content: content.pop("type")), "a policy of type None"),
        (change_settings(lambda content: content.update(type="act")), "a policy of type 'act'; only mask_act"),
        (change_settings(lambda content: content.update(colour=3)), "`colour` are not valid"),
        (change_settings(lambda content: content.update(n_heads=0)), "policy.n_heads=0"),
        (change_settings(lambda content: content.update(n_heads="many")), "n_heads.*'many'"),
        (change_settings(lambda content: content.update(output_features={})), "lacks 'action'"),
        (change_settings(lambda content: content["input_features"][STATE].update(shape=[0])), r"observation\.state"),
        (lambda file: file.write_text("[]"), "not settings by name"),
    ],
)
def test_settings_that_cannot_be_used_are_named(checkpoint, tmp_path, damage, message):
    damage(checkpoint / "config.json")
    with pytest.raises(ConfigurationError, match=message):
        export_checkpoint(checkpoint, tmp_path / "out")


def test_a_policy_that_was_saved_alone_loads_without_processors(policy, tmp_path):
    policy().save_pretrained(tmp_path)
    assert MaskACTPolicy.from_pretrained(tmp_path).config.dim_model == 32


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


def test_a_diverged_policy_is_refused(checkpoint, tmp_path):
    change_tensors(lambda tensors: tensors["model.action_head.weight"].fill_(1e5))(checkpoint / WEIGHTS)
    with pytest.raises(ConfigurationError, match=r"action_head\.weight holds values up to 100000"):
        export_checkpoint(checkpoint, tmp_path / "out")


def test_a_checkpoint_whose_mask_is_none_of_its_features_is_refused(checkpoint, tmp_path):
    config = json.loads((checkpoint / "config.json").read_text())
    (checkpoint / "config.json").write_text(json.dumps(config | {"mask_key": "observation.images.nowhere"}))
    with pytest.raises(ConfigurationError, match=r"config\.json: mask_key='observation\.images\.nowhere' is none of"):
        export_checkpoint(checkpoint, tmp_path / "out")
