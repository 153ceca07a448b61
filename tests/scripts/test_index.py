import shlex

import pytest

from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.scripts.main import main


@pytest.fixture
def output(capsys):
    """Run `lerobot-excav index` and return what it prints."""

    def run(*arguments):
        code = main(["index", *map(str, arguments)])
        captured = capsys.readouterr()
        return captured.out if code == 0 else captured.err

    return run


def test_the_index_is_rewritten_and_described(paired_dataset, output):
    before = build_index(paired_dataset)
    text = output(paired_dataset)
    assert build_index(paired_dataset).equals(before)
    for line in (
        "19 episodes",
        "table: wood, 19 episodes",
        "scenes: 5, of which 4 with all 4 targets",
        "missing: toy_reach/train/3/0 lacks target [1]",
        "final distance: 0.0",
    ):
        assert line in text
    assert "lerobot-train" not in text


def test_flags_alone_fit_into_a_command_line(paired_dataset, output):
    text = output(paired_dataset, "--select=paired", "--starts=3", "--split=scene", "--flags")
    episodes, ratio = shlex.split(text)
    assert len(episodes.removeprefix("--dataset.episodes=[").removesuffix("]").split(",")) == 12
    assert ratio == f"--dataset.eval_split={3.5 / 12}"


@pytest.mark.parametrize(
    ("options", "counts"),
    [
        (["--select=paired"], (16, 0)),
        (["--select=non-paired"], (5, 0)),
        (["--select=balanced"], (16, 0)),
        (["--select=balanced", "--episodes=8"], (8, 0)),
        (["--select=all", "--episodes=7"], (7, 0)),
        (["--include_failures"], (19, 0)),
        (["--split=episode", "--eval_fraction=0.4"], (11, 8)),
    ],
)
def test_selections_are_counted_and_quoted_for_the_shell(paired_dataset, output, options, counts):
    text = output(paired_dataset, *options)
    assert "chosen: {} episodes to train on, {} held out".format(*counts) in text
    assert "'--dataset.episodes=[" in text


def test_the_seed_reaches_the_split(paired_dataset, output):
    texts = {output(paired_dataset, "--split=scene", f"--seed={seed}", "--flags") for seed in range(5)}
    assert len(texts) > 1


@pytest.mark.parametrize("other", ["--flags", "--skip_restarted", "--operator=policy", "--select=paired", "--seed=3"])
def test_recovery_does_nothing_else(paired_dataset, output, other):
    assert "--recover only writes the dataset again" in output(paired_dataset, "--session=s", "--recover", other)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("--out=x", "--out is of use with --session only"),
        ("--skip_restarted", "--skip_restarted is of use with --session only"),
        ("--operator=policy", "--operator is of use with --session only"),
        ("--recover", "--recover is of use with --session only"),
        ("--task=go", "--task is of use with --recover only"),
        ("--eval_fraction=0.3", "--eval_fraction=0.3 has no effect without --split"),
        ("--seed=0", "--seed=0 has no effect without a choice"),
    ],
)
def test_options_without_effect_are_refused(paired_dataset, output, option, message):
    assert message in output(paired_dataset, option)
    assert message in output(paired_dataset, option, "--flags")
