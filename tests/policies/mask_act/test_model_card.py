import json

import pytest
import yaml

from lerobot_excav.policies.mask_act.model_card import CardFacts, model_card

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
    folder = tmp_path / "004000" / "pretrained_model"
    folder.mkdir(parents=True)
    (folder / "train_config.json").write_text(json.dumps(SETTINGS))
    state = folder.parent / "training_state"
    state.mkdir()
    (state / "training_step.json").write_text(json.dumps({"step": 4000}))
    return folder


def front_matter(card):
    _, head, _ = card.split("---\n", 2)
    return yaml.safe_load(head)


def test_the_front_matter_is_what_the_hub_reads(trained, config):
    assert front_matter(model_card(trained, config(), 1, CardFacts(license="mit"))) == {
        "library_name": "lerobot",
        "license": "mit",
        "model_name": "mask_act",
        "pipeline_tag": "robotics",
        "tags": ["lerobot", "mask_act", "robotics"],
        "datasets": "local/grasping",
    }


def test_the_card_tells_how_the_policy_was_trained(trained, config):
    card = model_card(trained, config(), 1, CardFacts())
    rows = ["Episodes | 3", "Steps | 4000", "Batch size | 16", "Learning rate | 0.0003", "Seed | 7"]
    assert [row for row in rows if row not in card] == []
    assert "/data" not in card


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
    assert f"| Held out for validation | {held_out} |" in model_card(trained, config(), 1, CardFacts())


def test_without_training_settings_the_card_does_not_speak_of_training(tmp_path, config):
    card = model_card(tmp_path, config(), 1, CardFacts())
    assert "## Training" not in card
    assert "datasets" not in front_matter(card)


def test_the_card_tells_network_and_features(tmp_path, config):
    card = model_card(tmp_path, config(), 2_700_000, CardFacts())
    rows = ["| Parameters | 2.7 million |", "| Preset | fast |", "| `observation.state` | STATE | (8,) |"]
    assert [row for row in rows if row not in card] == []


def test_the_card_tells_which_paths_the_mask_has(tmp_path, config):
    plain, token, blind = (
        model_card(tmp_path, config(**settings), 1, CardFacts())
        for settings in ({}, {"target_token": True}, {"withhold_mask": True})
    )
    assert "fourth channel of the main camera." in plain
    assert "and a token pooled under the mask" in token
    assert "no-condition variant" in blind


@pytest.mark.parametrize(("channels", "word"), [(True, "yes"), (False, "no")])
def test_the_card_tells_whether_pixels_have_coordinates(tmp_path, config, channels, word):
    card = model_card(tmp_path, config(coordinate_channels=channels), 1, CardFacts())
    assert f"| Coordinate channels | {word} |" in card
    assert ("row and column of every pixel" in card) == channels


def test_facts_make_title_command_and_results(tmp_path, config):
    facts = CardFacts(title="Grasping", env_type="fr5_grasp", results="| row |\n")
    card = model_card(tmp_path, config(), 1, facts)
    assert "\n# Grasping\n" in card
    assert "--env.type=fr5_grasp " in card
    assert card.endswith("## Evaluation\n\n| row |\n")
