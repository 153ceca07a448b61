"""Checkpoints that were changed at random, exported and loaded as `lerobot-eval` loads them."""

import json
import shutil

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from lerobot.configs import PreTrainedConfig
from lerobot.policies.factory import make_pre_post_processors
from safetensors.torch import load_file, save_file

from lerobot_excav.errors import ExcavError
from lerobot_excav.policies.mask_act import export
from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy
from lerobot_excav.policies.mask_act.processor_mask_act import make_mask_act_pre_post_processors

from ..policies.mask_act.conftest import CAB, MAIN, STATE, make_policy
from .mutation import (
    GARBAGE,
    Outcome,
    digests,
    harmful,
    harmless,
    inputs,
    overwritten,
    require_kept,
    require_right,
    run,
    truncated,
)

WEIGHTS, CONFIG = "model.safetensors", "config.json"
PROCESSORS = ("policy_preprocessor.json", "policy_postprocessor.json")
STATISTICS = (
    "policy_preprocessor_step_3_normalizer_processor.safetensors",
    "policy_postprocessor_step_0_unnormalizer_processor.safetensors",
)
# What a setting cannot be, by what `docs/reference/mask_act.md` says that it is.
WRONG_SETTINGS = {
    "type": ["act", "no_such_policy", None, 3],
    "chunk_size": [0, -8, "many", None, 2.5, 10**12],
    "dim_model": [0, -32, 33, "wide", 64],
    "n_heads": [0, -1, 5],
    "dropout": [-0.1, 1.0, float("nan")],
    "temporal_ensemble_coeff": [-1.0, float("nan"), float("inf")],
    "vision_backbone": ["vgg16", "", 3],
    "backbone_norm": ["layer", 1],
    "preset": ["slow", 3],
    "input_features": [{}, None, 3, {"observation.state": {"type": "STATE", "shape": [8]}}],
    "output_features": [None, 3, {}],
    "mask_key": ["observation.images.nowhere"],
    "main_camera": ["observation.images.nowhere", "observation.images.target_mask"],
    "actions_per_token": [0, 3, -4],
}
HARMLESS_SETTINGS = {
    "license": ["mit", None],
    "tags": [None, ["excavator"]],
    "optimizer_lr": [1e-4, 1e-3],
    "lr_warmup_steps": [0, 10],
    "push_to_hub": [False],
}


@pytest.fixture(scope="session")
def trained(tmp_path_factory):
    """What lerobot-train leaves in `pretrained_model`, of a tiny policy. Not to be changed by tests."""
    folder = tmp_path_factory.mktemp("trained") / "pretrained_model"
    policy = make_policy(target_token=True)
    policy.save_pretrained(folder)
    sizes = {STATE: (8,), "action": (4,), **dict.fromkeys((MAIN, CAB), (3, 1, 1))}
    stats = {key: {"mean": torch.zeros(size), "std": torch.ones(size)} for key, size in sizes.items()}
    for pipeline in make_mask_act_pre_post_processors(policy.config, stats):
        pipeline.save_pretrained(folder)
    return folder


def weights_change(change):
    def apply(folder):
        weights = load_file(folder / WEIGHTS)
        change(weights)
        save_file(weights, folder / WEIGHTS, metadata={"format": "pt"})

    return apply


def drop(share, seed):
    def change(weights):
        names = sorted(weights)
        order = torch.randperm(len(names), generator=torch.Generator().manual_seed(seed)).tolist()
        for number in order[: max(1, round(share * len(names)))]:
            del weights[names[number]]

    return change


def spoil(kind, number):
    """Change one of the weights."""

    def change(weights):
        names = sorted(name for name, value in weights.items() if value.dim() > 0 and value.is_floating_point())
        name = names[number % len(names)]
        value = weights[name]
        if kind == "renamed":
            weights[f"{name}_old"] = weights.pop(name)
        elif kind == "longer":
            weights[name] = torch.cat([value, value])
        elif kind == "shorter":
            weights[name] = value[:-1].clone() if len(value) > 1 else torch.cat([value, value])
        elif kind == "added":
            weights["model.stranger"] = torch.zeros(3)
        else:
            weights[name] = value.clone()
            weights[name].view(-1)[0] = {"nan": float("nan"), "inf": float("inf")}[kind]

    return change


@st.composite
def changed_weights(draw):
    kind = draw(
        st.sampled_from(["dropped", "all dropped", "renamed", "longer", "shorter", "added", "nan", "inf", "same"])
    )
    number = draw(st.integers(0, 1000))
    if kind == "same":
        return harmless("weights written again", weights_change(lambda weights: None))
    if kind == "all dropped":
        return harmful("no weights", weights_change(lambda weights: weights.clear()))
    if kind == "dropped":
        share = draw(st.sampled_from([0.0, 0.3, 0.9]))
        return harmful(f"{share} of the weights dropped, seed {number}", weights_change(drop(share, number)))
    return harmful(f"weight {number} {kind}", weights_change(spoil(kind, number)))


@st.composite
def changed_files(draw):
    kind = draw(st.sampled_from(["garbage", "cut off", "gone", "stranger", "card"]))
    name = draw(st.sampled_from([WEIGHTS, CONFIG, *PROCESSORS, *STATISTICS]))
    if kind == "garbage":
        return overwritten(name, draw(GARBAGE))
    if kind == "cut off":
        return truncated(name, draw(st.floats(0.0, 0.99)))
    if kind == "gone":
        return harmful(f"{name} is gone", lambda folder: (folder / name).unlink())
    other = "README.md" if kind == "card" else "notes.txt"
    return harmless(f"{other} beside it", lambda folder: (folder / other).write_text("mine"))


@st.composite
def changed_settings(draw):
    kind = draw(st.sampled_from(["wrong", "harmless", "unknown", "not an object"]))
    if kind == "not an object":
        data = json.dumps(draw(st.sampled_from([[], 3, "x", None]))).encode()
        return overwritten(CONFIG, data)
    table = HARMLESS_SETTINGS if kind == "harmless" else WRONG_SETTINGS
    name = draw(st.sampled_from(sorted(table)))
    value = draw(st.sampled_from(table[name]))
    if kind == "unknown":
        name, value = draw(st.sampled_from(["n_wheels", "chunksize"])), 4

    def apply(folder):
        config = json.loads((folder / CONFIG).read_text())
        config[name] = value
        (folder / CONFIG).write_text(json.dumps(config))

    label = harmless if kind == "harmless" else harmful
    return label(f"config.json: {name}={value!r}", apply)


def load(folder):
    """Load policy and processors as `lerobot-eval` does, and plan once."""
    try:
        config = PreTrainedConfig.from_pretrained(folder)
        config.pretrained_path = folder
        MaskACTPolicy.from_pretrained(folder, config=config)
        make_pre_post_processors(config, pretrained_path=str(folder))
    except (ExcavError, OSError) as error:
        return Outcome(2, str(error))
    return Outcome(0, "loaded")


def judge(change, trained, folder):
    """Export a changed checkpoint."""
    shutil.copytree(trained, folder / "checkpoint")
    change.apply(folder / "checkpoint")
    (folder / "thesis.md").write_text("three years of work")
    before = digests(folder)
    require_right(change, run("export", folder / "checkpoint", f"--out={folder / 'out'}"))
    require_kept(before, digests(folder))


@inputs(few=12)
@given(change=st.one_of(changed_weights(), changed_files(), changed_settings()))
def test_a_changed_checkpoint_is_refused_in_words_or_exported(tmp_path_factory, trained, change):
    judge(change, trained, tmp_path_factory.mktemp("checkpoint"))


@inputs(few=8, many=300)
@given(change=changed_weights())
def test_a_policy_with_other_weights_than_its_own_does_not_play(tmp_path_factory, trained, change):
    folder = tmp_path_factory.mktemp("weights") / "checkpoint"
    shutil.copytree(trained, folder)
    change.apply(folder)
    require_right(change, load(folder))


def test_an_export_that_believes_everything_is_found_out(tmp_path, trained, monkeypatch):
    monkeypatch.setattr(export, "export_checkpoint", lambda checkpoint, out, facts, **_: out.mkdir())
    change = harmful("no weights", weights_change(lambda weights: weights.clear()))
    with pytest.raises(AssertionError, match="accepted in silence"):
        judge(change, trained, tmp_path)


@pytest.mark.parametrize(
    ("fault", "found"),
    [
        (lambda checkpoint: {}["no such weight"], KeyError),  # a traceback
        (lambda checkpoint: checkpoint.with_name("thesis.md").unlink(), AssertionError),  # a lost file
    ],
)
def test_an_export_that_breaks_or_removes_a_file_is_found_out(tmp_path, trained, monkeypatch, fault, found):
    read = export.read_config
    monkeypatch.setattr(export, "read_config", lambda checkpoint: (fault(checkpoint), read(checkpoint))[1])
    with pytest.raises(found, match=r"no such weight|lost or changed: .*thesis\.md"):
        judge(harmless("nothing", lambda folder: None), trained, tmp_path)
