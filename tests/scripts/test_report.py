import json

import pytest

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.scripts.main import main
from lerobot_excav.scripts.report import runs_from

from ..evaluation.conftest import GRASP, line


@pytest.fixture
def metrics(tmp_path):
    """Write a metrics file with one episode per given return."""

    def write(name, *returns):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        lines = [line(GRASP, number, episode_return=value) for number, value in enumerate(returns)]
        path.write_text("".join(json.dumps(line) + "\n" for line in lines))
        return path

    return write


def test_a_report_is_printed_and_written(metrics, tmp_path, capsys):
    policy, operator = metrics("policy.jsonl", 200.0, 220.0), metrics("operator.jsonl", 400.0, 440.0)
    assert main(["report", str(policy), f"--operator={operator}", f"--out={tmp_path / 'r'}"]) == 0
    text = capsys.readouterr().out
    assert "210.0 [200.0, 220.0]" in text
    assert "Operator: not stated" in text
    assert json.loads((tmp_path / "r" / "report.json").read_text())["runs"][0]["label"] == "policy"
    assert (tmp_path / "r" / "report.md").is_file()


def test_files_of_one_label_are_seeds_of_one_run(metrics):
    a1, a2, b = (metrics(f"{name}.jsonl", 1.0) for name in ("a1", "a2", "b"))
    first, second = runs_from([f"a={a1}", f"a={a2}", str(b)])
    assert (first.label, len(first.evaluations)) == ("a", 2)
    assert (second.label, len(second.evaluations)) == ("b", 1)


def test_a_file_called_metrics_and_its_folder_are_named_by_the_folder(metrics):
    path = metrics("masked/metrics.jsonl", 1.0)
    assert [runs_from([str(name)])[0].label for name in (path, path.parent)] == ["masked", "masked"]


@pytest.mark.parametrize(("first", "second"), [("", ""), ("", "m="), ("m=", "")])
def test_only_an_explicit_label_makes_files_seeds_of_one_run(metrics, first, second):
    paths = [metrics("a/m.jsonl", 1.0), metrics("b/m.jsonl", 1.0)]
    with pytest.raises(ConfigurationError, match="both be called 'm'; name them LABEL=FILE"):
        runs_from([f"{first}{paths[0]}", f"{second}{paths[1]}"])


def test_a_path_may_hold_an_equals_sign(metrics):
    path = metrics("lr=1/m.jsonl", 1.0)
    assert [runs_from([name])[0].label for name in (str(path), f"a={path}")] == ["m", "a"]


def test_a_file_given_twice_is_refused(metrics):
    path = metrics("a.jsonl", 1.0)
    with pytest.raises(ConfigurationError, match="twice"):
        runs_from([f"a={path}", f"b={path}"])


def test_the_bootstrap_seed_is_an_option(metrics, capsys):
    path = metrics("a.jsonl", *(float(i * i) for i in range(9)))
    main(["report", str(path), "--seed=5"])
    assert "(seed 5)" in capsys.readouterr().out


@pytest.fixture
def rows(metrics, tmp_path):
    """A page of two rows, one of which was run."""
    metrics("test/mine.jsonl", 200.0, 220.0)
    path = tmp_path / "rows.toml"
    row = '{ label = "mine", about = "my policy", paper = { success = 91.0 } }'
    path.write_text(f'''
title = "Grasping"
metrics = "{tmp_path}/test"
[[section]]
title = "All"
rows = [{row}, {{ label = "yours", about = "your policy" }}]
''')
    return path


def test_a_page_is_printed(rows, capsys):
    assert main(["report", f"--rows={rows}"]) == 0
    text = capsys.readouterr().out
    for shown in ("# Grasping", "| my policy | correct | 2", "| 91 ", "Not run: yours."):
        assert shown in text


def test_a_page_is_written_and_made_again_from_its_metrics(rows, tmp_path, capsys):
    folders = [tmp_path / "page", tmp_path / "again"]
    assert main(["report", f"--rows={rows}", f"--out={folders[0]}"]) == 0
    copies = f"--metrics_folder={folders[0] / 'metrics'}"
    assert main(["report", f"--rows={rows}", copies, f"--out={folders[1]}"]) == 0
    first, second = (folder / "report.md" for folder in folders)
    assert first.read_text() == second.read_text()
    assert f"written: {second}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give either metrics files or --rows"),
        (["a.jsonl", "--rows=r.toml"], "give either metrics files or --rows"),
        (["a.jsonl", "--metrics_folder=m"], "--metrics_folder=m is of use with --rows only"),
        (["a.jsonl", "--videos_folder=m"], "--videos_folder=m is of use with --rows only"),
        (["--rows=r.toml", "--operator=o"], "--operator is of use with metrics files only"),
    ],
)
def test_options_without_effect_are_refused(arguments, message, capsys):
    assert main(["report", *arguments]) == 2
    assert message in capsys.readouterr().err
