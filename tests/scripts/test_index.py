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


def test_missing_targets_are_listed(paired_dataset, output):
    text = output(paired_dataset)
    assert "19 episodes" in text
    assert "soil: sand, 19 episodes" in text
    assert "scenes: 5, of which 4 with all 4 targets" in text
    assert "missing: excavator/train/3 lacks target [1]" in text
    assert "lerobot-train" not in text


def test_flags_alone_fit_into_a_command_line(paired_dataset, output):
    text = output(paired_dataset, "--select=paired", "--scenes=3", "--split=scene", "--flags")
    episodes, ratio = shlex.split(text)
    assert len(episodes.removeprefix("--dataset.episodes=[").removesuffix("]").split(",")) == 12
    assert ratio == f"--dataset.eval_split={3.5 / 12}"


def test_the_printed_command_quotes_brackets_for_the_shell(paired_dataset, output):
    assert "'--dataset.episodes=[" in output(paired_dataset, "--split=episode")


@pytest.mark.parametrize(
    ("options", "count"),
    [
        (["--select=paired"], 16),
        (["--select=non-paired"], 5),
        (["--select=balanced"], 16),
        (["--select=balanced", "--episodes=8"], 8),
        (["--select=all", "--episodes=7"], 7),
    ],
)
def test_selections_are_counted(paired_dataset, output, options, count):
    assert f"chosen: {count} episodes to train on, 0 held out" in output(paired_dataset, *options)


def test_seed_and_fraction_reach_the_split(paired_dataset, output):
    texts = {output(paired_dataset, "--split=scene", f"--seed={seed}", "--flags") for seed in range(5)}
    assert len(texts) > 1
    assert "11 episodes to train on, 8 held out" in output(
        paired_dataset, "--split=episode", "--eval-fraction=0.4"
    )


def test_out_and_skipping_need_a_session(paired_dataset, output, tmp_path):
    assert "--session only" in output(paired_dataset, f"--out={tmp_path / 'x'}")
    assert "--session only" in output(paired_dataset, "--skip-restarted")


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("--eval-fraction=0.3", "--eval-fraction=0.3 has no effect without --split"),
        ("--seed=0", "--seed=0 has no effect without a choice"),
    ],
)
def test_options_without_effect_are_refused(paired_dataset, output, option, message):
    assert message in output(paired_dataset, option)
    assert message in output(paired_dataset, option, "--flags")


def test_indexing_rewrites_the_index_only(paired_dataset, output):
    before = build_index(paired_dataset)
    output(paired_dataset)
    assert build_index(paired_dataset).equals(before)
