import pytest

from lerobot_excav.policies.mask_act import export
from lerobot_excav.policies.mask_act.model_card import CardFacts
from lerobot_excav.scripts.main import main


@pytest.fixture
def asked(monkeypatch):
    """What the command asks of the export, which writes one file of a megabyte instead."""
    calls = []

    def write(checkpoint, out, facts):
        calls.append((checkpoint, out, facts))
        out.mkdir()
        (out / "model.safetensors").write_bytes(bytes(1_000_000))
        return out

    monkeypatch.setattr(export, "export_checkpoint", write)
    return calls


def test_the_folder_is_written_and_its_size_told(asked, tmp_path, capsys):
    assert main(["export", "checkpoint", f"--out={tmp_path / 'small'}"]) == 0
    text = capsys.readouterr().out
    assert "1.0 MB" in text
    assert f"--policy.path={tmp_path / 'small'}" in text
    assert asked[0][2] == CardFacts()


def test_the_options_are_facts_of_the_card(asked, tmp_path):
    (tmp_path / "table.md").write_text("98 of 100")
    options = [f"--results={tmp_path / 'table.md'}", "--title=Grasping", "--env=fr5_grasp", "--license=mit"]
    main(["export", "checkpoint", f"--out={tmp_path / 'small'}", *options])
    assert asked[0][2] == CardFacts(
        title="Grasping", env_type="fr5_grasp", results="98 of 100", license="mit"
    )


def test_a_folder_that_is_no_checkpoint_is_an_error(tmp_path, capsys):
    assert main(["export", str(tmp_path), f"--out={tmp_path / 'small'}"]) == 2
    assert "pretrained_model" in capsys.readouterr().err
