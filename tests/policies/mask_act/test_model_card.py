import json
from pathlib import Path

import pytest
from huggingface_hub import ModelCard
from lerobot.configs import PreTrainedConfig

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.model_card import CardFacts, model_card

LANDED = Path(__file__).parents[3] / "checkpoints" / "fr5_grasp_mask_act"
SETTINGS = {
    "dataset": {"repo_id": "local/grasping", "root": "/data", "episodes": [0, 1, 2], "eval_split": 0.2},
    "optimizer": {"lr": 3e-4},
    "steps": 5000,
    "batch_size": 16,
    "seed": 7,
}


@pytest.fixture
def trained(tmp_path):
    """The folders of a checkpoint at step 4000 of 5000."""
    folder, state = tmp_path / "004000" / "pretrained_model", tmp_path / "004000" / "training_state"
    folder.mkdir(parents=True)
    state.mkdir()
    (folder / "train_config.json").write_text(json.dumps(SETTINGS))
    (state / "training_step.json").write_text(json.dumps({"step": 4000}))
    return folder


@pytest.mark.parametrize("text", ["{", "[1]", "{}", '{"dataset": 3}'])
def test_damaged_training_settings_are_named(trained, config, text):
    (trained / "train_config.json").write_text(text)
    with pytest.raises(ConfigurationError, match=r"train_config\.json .*(cannot be read|damaged|not settings)"):
        model_card(trained, config(), 1, CardFacts())


def missing(card, *rows):
    return [row for row in rows if row not in str(card)]


def test_the_card_tells_how_the_policy_was_trained_where_that_is_known(trained, tmp_path, config):
    card = model_card(trained, config(), 1, CardFacts(license="mit"))
    assert (card.data.datasets, card.data.license) == ("local/grasping", "mit")
    rows = ["Episodes | 3", "Steps | 4000", "Batch size | 16", "Learning rate | 0.0003", "Seed | 7"]
    assert missing(card, *rows) == []
    assert "/data" not in str(card)
    card = model_card(tmp_path, config(), 1, CardFacts())
    assert "## Training" not in str(card)
    assert "datasets" not in card.data.to_dict()


@pytest.mark.parametrize(
    ("dataset", "held_out"),
    [
        ({"episodes": list(range(200)), "eval_split": 0.1975}, "40"),
        ({"episodes": [0, 1, 2], "eval_split": 0.0}, "0"),
        ({"episodes": None, "eval_split": 0.1975}, "19.75 %"),
    ],
)
def test_the_card_counts_the_held_out_episodes_where_it_can(trained, config, dataset, held_out):
    settings = {**SETTINGS, "dataset": {"repo_id": "local/grasping", **dataset}}
    (trained / "train_config.json").write_text(json.dumps(settings))
    card = model_card(trained, config(), 1, CardFacts())
    assert missing(card, f"| Held out for validation | {held_out} |") == []


NETWORK = [
    "| Parameters | 2.7 million |",
    "| Preset | fast, with dim_model=32, dim_feedforward=48, n_encoder_layers=1 |",
    "| `observation.state` | STATE | (8,) |",
]
PLAIN = ["four-channel views; trained", "a fourth channel of the main camera. ", "| Coordinate channels | no |"]


@pytest.mark.parametrize(
    ("settings", "rows"),
    [
        ({}, NETWORK + PLAIN),
        ({"target_token": True}, ["main camera and a token pooled under the mask. ", "| Target token | yes |"]),
        ({"withhold_mask": True}, ["(`withhold_mask`): the no-condition variant. Weights"]),
        ({"mask_shape": "box", "target_token": True}, ["reads its bounding box as a fourth", "pooled under it. "]),
        ({"mask_shape": "point"}, ["reads a point at its middle as a fourth"]),
        (
            {"withhold_pictures": True},
            ["main camera. It never sees the colours of any camera (`withhold_pictures`). W"],
        ),
        ({"coordinate_channels": True}, ["row and column of every pixel", "| Coordinate channels | yes |"]),
    ],
)
def test_the_card_tells_network_features_and_paths_of_the_mask(tmp_path, config, settings, rows):
    assert missing(model_card(tmp_path, config(**settings), 2_700_000, CardFacts()), *rows) == []


HELD = [
    "up to 20 frames | `hold_mask_frames=20`",
    "same to the pixel | `replan_iou=1.0`",
    "from where it is | `backtrack_fr",
]
STEADY = ["an empty one is shown | `hold_mask_frames=0`", "by an IoU of 0.2 or more | `replan_iou=0.2`"]
BACK = ["if it has come no farther than 100 frames, 3 times as fast, and plans from there | `backtrack_frames=100`"]


@pytest.mark.parametrize(
    ("settings", "rows"),
    [
        ({}, HELD),
        ({"hold_mask_frames": 0, "replan_iou": 0.2}, STEADY),
        ({"backtrack_frames": 100, "backtrack_stride": 3}, BACK),
        ({"backtrack_frames": 9}, ["if it has come no farther than 9 frames, and plans from there"]),
    ],
)
def test_the_card_tells_what_the_policy_does_while_it_runs(tmp_path, config, settings, rows):
    assert missing(model_card(tmp_path, config(**settings), 1, CardFacts()), *rows) == []


def test_the_card_of_a_policy_that_sees_no_mask_tells_nothing_of_its_absence(tmp_path, config):
    assert "While it runs" not in str(model_card(tmp_path, config(withhold_mask=True), 1, CardFacts()))


def test_facts_make_title_command_and_results(tmp_path, config):
    facts = CardFacts(title="Grasping", env_type="fr5_grasp", results="| row |\n")
    card = model_card(tmp_path, config(), 1, facts)
    assert missing(card, "\n# Grasping\n", "--env.type=fr5_grasp ") == []
    assert str(card).endswith("## Evaluation\n\n| row |\n")


def test_the_landed_card_is_what_the_template_gives():
    landed = ModelCard.load(LANDED / "README.md")
    facts = CardFacts(title="FR5 grasping: mask_act with a target token", env_type="fr5_grasp")
    fresh = model_card(LANDED, PreTrainedConfig.from_pretrained(LANDED), 1_800_000, facts)
    assert {**fresh.data.to_dict(), "datasets": "local/fr5_grasp_paired"} == landed.data.to_dict()
    sections, expected = (
        {part.partition("\n")[0]: part for part in card.text.split("\n## ")} for card in (landed, fresh)
    )
    # The training settings and the results were given when the card was written.
    assert sections.keys() - expected.keys() == {"Training"}
    assert {name for name, part in expected.items() if part != sections[name]} == {"Evaluation"}
