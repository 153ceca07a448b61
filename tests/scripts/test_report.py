import json

import pytest

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.scripts.main import main
from lerobot_excav.scripts.report import runs_from


@pytest.fixture
def metrics(tmp_path):
    """Write a metrics file with one episode per given retained mass."""

    def write(name, *masses):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        common = {"scene_set": "test", "target_id": 0, "mask_condition": "correct"}
        common |= {"soil": "sand", "fidelity": "standard"}
        outcome = {"target_success": True, "is_success": True, "residual_bucket_mass_kg": 0.0}
        events = {"hard_target_contacts": 0, "spill_before_target_events": 0}
        lines = [
            {**common, **outcome, **events, "scene_id": number, "retained_mass_kg": mass}
            for number, mass in enumerate(masses)
        ]
        path.write_text("".join(json.dumps(line) + "\n" for line in lines))
        return path

    return write


def test_a_report_is_printed_and_written(metrics, tmp_path, capsys):
    policy, operator = metrics("policy.jsonl", 200.0, 220.0), metrics("operator.jsonl", 400.0, 440.0)
    assert main(["report", str(policy), f"--operator={operator}", f"--out={tmp_path / 'r'}"]) == 0
    text = capsys.readouterr().out
    assert "50.0 [50.0, 50.0]" in text
    assert "operator: not stated" in text
    assert json.loads((tmp_path / "r" / "report.json").read_text())["runs"][0]["label"] == "policy"
    assert (tmp_path / "r" / "report.md").is_file()


def test_files_of_one_label_are_seeds_of_one_run(metrics):
    a1, a2, b = (metrics(f"{name}.jsonl", 1.0) for name in ("a1", "a2", "b"))
    first, second = runs_from([f"a={a1}", f"a={a2}", str(b)])
    assert (first.label, len(first.evaluations)) == ("a", 2)
    assert (second.label, len(second.evaluations)) == ("b", 1)


def test_a_file_called_metrics_is_named_by_its_folder(metrics):
    path = metrics("masked/metrics.jsonl", 1.0)
    assert [run.label for run in runs_from([str(path)])] == ["masked"]


def test_a_folder_is_named_by_itself(metrics):
    path = metrics("masked/metrics.jsonl", 1.0)
    assert [run.label for run in runs_from([str(path.parent)])] == ["masked"]


@pytest.mark.parametrize(("first", "second"), [("", ""), ("", "m="), ("m=", "")])
def test_only_an_explicit_label_makes_files_seeds_of_one_run(metrics, first, second):
    paths = [metrics("a/m.jsonl", 1.0), metrics("b/m.jsonl", 1.0)]
    with pytest.raises(ConfigurationError, match="both be called 'm'; name them LABEL=FILE"):
        runs_from([f"{first}{paths[0]}", f"{second}{paths[1]}"])


def test_a_path_may_hold_an_equals_sign(metrics):
    path = metrics("lr=1/m.jsonl", 1.0)
    labels = [run.label for run in runs_from([str(path)])]
    assert labels == ["m"]
    assert [run.label for run in runs_from([f"a={path}"])] == ["a"]


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
    row = '{ label = "mine", about = "my policy", paper = { full_success = 91.0 } }'
    path.write_text(f'''
title = "Digging"
metrics = "{tmp_path}/test"
[[section]]
title = "All"
rows = [{row}, {{ label = "yours", about = "your policy" }}]
''')
    return path


def test_a_page_is_printed(rows, capsys):
    assert main(["report", f"--rows={rows}"]) == 0
    text = capsys.readouterr().out
    assert "# Digging" in text
    assert "| my policy | sand | correct | 2" in text
    assert "| 91 " in text
    assert "Not run: yours." in text


def test_a_page_is_written_and_made_anew_from_its_metrics(rows, tmp_path, capsys):
    assert main(["report", f"--rows={rows}", f"--out={tmp_path / 'page'}"]) == 0
    again = [
        "report",
        f"--rows={rows}",
        f"--metrics={tmp_path / 'page/metrics'}",
        f"--out={tmp_path / 'again'}",
    ]
    assert main(again) == 0
    first, second = (tmp_path / name / "report.md" for name in ("page", "again"))
    assert first.read_text() == second.read_text()
    assert f"written: {second}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give either RESULTS or --rows"),
        (["a.jsonl", "--rows=r.toml"], "give either RESULTS or --rows"),
        (["a.jsonl", "--metrics=m"], "--metrics=m is of use with --rows only"),
        (["--rows=r.toml", "--operator=o"], "--operator is of use with RESULTS only"),
    ],
)
def test_options_without_effect_are_refused(arguments, message, capsys):
    assert main(["report", *arguments]) == 2
    assert message in capsys.readouterr().err
