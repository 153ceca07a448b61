import json
from pathlib import Path

import pytest

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.training import read_training
from lerobot_excav.policies.mask_act import export
from lerobot_excav.policies.mask_act.model_card import CardFacts
from lerobot_excav.scripts.export import ExportArguments, run


def test_the_options_are_facts_of_the_card_and_the_size_is_told(monkeypatch, tmp_path, capsys):
    asked = []

    def write(checkpoint, out, facts, *, beside):
        asked.append((checkpoint, facts))
        out.mkdir()
        (out / "model.safetensors").write_bytes(bytes(1_000_000))
        return out

    monkeypatch.setattr(export, "export_checkpoint", write)
    (tmp_path / "table.md").write_text("98 of 100")
    given = {"title": "Grasping", "env": "fr5_grasp", "license": "mit", "results": tmp_path / "table.md"}
    for out, settings in (("plain", {}), ("full", given)):
        assert run(ExportArguments(checkpoint=Path("run"), out=tmp_path / out, **settings)) == 0
    full = CardFacts(title="Grasping", env_type="fr5_grasp", results="98 of 100", license="mit")
    assert asked == [(Path("run"), CardFacts()), (Path("run"), full)]
    assert f"full: 1.0 MB; run it with lerobot-eval --policy.path={tmp_path / 'full'}\n" in capsys.readouterr().out


def test_how_it_was_trained_stays_known(monkeypatch, tmp_path):
    def write(checkpoint, out, facts, *, beside):
        out.mkdir()
        for name, text in beside.items():
            (out / name).write_text(text)

    monkeypatch.setattr(export, "export_checkpoint", write)
    checkpoint = tmp_path / "train" / "paired" / "checkpoints" / "000400" / "pretrained_model"
    checkpoint.mkdir(parents=True)
    config = {"dataset": {"repo_id": "local/x", "episodes": [0, 1, 2]}, "batch_size": 8, "seed": 7}
    (checkpoint / "train_config.json").write_text(json.dumps(config))
    assert run(ExportArguments(checkpoint=checkpoint, out=tmp_path / "small")) == 0
    training = read_training(tmp_path / "small")
    assert training == read_training(checkpoint)
    assert (training.name, training.demonstrations, training.seed) == ("paired", 3, 7)


@pytest.mark.parametrize("checkpoint", [None, Path("no/such/folder")])
def test_what_is_not_a_checkpoint_is_an_error_that_says_what_to_give(tmp_path, checkpoint):
    with pytest.raises(ConfigurationError, match=r"checkpoint.*give the pretrained_model"):
        run(ExportArguments(checkpoint=checkpoint, out=tmp_path / "small"))


def test_results_that_are_not_text_are_named(tmp_path):
    (tmp_path / "table.md").write_bytes(b"\xff\xfe98 of 100")
    with pytest.raises(ConfigurationError, match=r"--results=.*table\.md is not text"):
        run(ExportArguments(checkpoint=Path("run"), out=tmp_path / "small", results=tmp_path / "table.md"))


def test_the_card_names_an_environment_that_exists():
    with pytest.raises(ConfigurationError, match=r"--env='lathe' is not possible; give one of excavator, fr5_grasp"):
        ExportArguments(env="lathe")
