"""`lerobot-excav segmenter`: a short training, and the score of what it has made."""

import pytest
import torch
from safetensors.torch import load_file

from lerobot_excav.envs.masks.click.segmenter import ClickSegmenter
from lerobot_excav.scripts.main import main

SHORT = ["--env_types=fr5_grasp", "--score_scenes=2"]


@pytest.mark.slow
def test_a_network_is_trained_written_and_measured_and_the_seed_decides(tmp_path, capsys):
    outs = [tmp_path / f"{name}.safetensors" for name in ("first", "again", "other")]
    for out, seed in zip(outs, (3, 3, 4), strict=True):
        assert main(["segmenter", *SHORT, "--scenes=2", "--steps=10", f"--seed={seed}", f"--out={out}"]) == 0
    first, again, other = (load_file(out) for out in outs)
    assert all(torch.equal(first[name], again[name]) for name in first)
    assert not all(torch.equal(first[name], other[name]) for name in first)
    printed = capsys.readouterr().out
    assert "MB, trained in" in printed
    assert "| fr5_grasp | 2 | 8 | 0." in printed
    facts = ClickSegmenter.load(outs[2]).facts
    assert facts == {
        "trained_on": "fr5_grasp: train scenes 0 to 1 of each",
        "steps": "10",
        "batch_size": "16",
        "seed": "4",
    }
    assert main(["segmenter", *SHORT, f"--model={outs[0]}"]) == 0
    assert main(["segmenter", *SHORT, f"--out={outs[0]}"]) == 2
    assert "exists; choose another file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--env_types=excavator,arm"], "--env_types='excavator,arm' is not a list of environments"),
        (["--out=a.safetensors", "--model=b.safetensors"], "leave --out=a.safetensors or --model out"),
        (["--out=a.safetensors", "--scene_set=train"], "would measure on what was learned"),
        (["--model=nowhere.safetensors"], "model=nowhere.safetensors holds no click segmenter"),
    ],
)
def test_options_that_cannot_be_used_are_named(options, words, capsys):
    assert main(["segmenter", *options]) == 2
    assert words in capsys.readouterr().err
