import json

import pytest

from validation.soil import catalogue
from validation.soil.__main__ import main
from validation.soil.experiment import SoilExperiment
from validation.soil.results import Check, Result


@pytest.fixture
def asked(monkeypatch):
    """Three quick experiments in place of the real ones; returns the conditions under which they ran."""
    conditions = []

    def one(name, value, *, is_timed=False):
        def run(given):
            conditions.append((name, given))
            return Result(checks=(Check("mass", value, "kg", high=1.0),))

        return SoilExperiment(name=name, title=name, source="", measures="", gate="", run=run, is_timed=is_timed)

    experiments = (one("first", 0.5), one("second", 2.0), one("third", 2.0, is_timed=True))
    monkeypatch.setattr(catalogue, "EXPERIMENTS", experiments)
    return conditions


def test_every_value_is_printed_beside_its_gate_and_a_miss_is_exit_code_1(asked, capsys):
    assert main([]) == 1
    shown = capsys.readouterr().out.splitlines()
    assert ["MISSED by 1 kg" in line for line in shown] == [False, True, True]
    assert "0.5 kg" in shown[0]
    assert [name for name, _ in asked] == ["first", "second", "third"]


def test_times_decide_no_exit_code(asked):
    assert main(["--only=first,third"]) == 0


def test_options_reach_the_experiments(asked):
    main(["--only=first", "--soil=gravel", "--fidelity=fast", "--seeds=4,5", "--quick"])
    _, conditions = asked[0]
    assert (conditions.preset, conditions.fidelity, conditions.seeds) == ("gravel", "fast", (4, 5))
    assert conditions.quick


def test_values_and_report_are_written(asked, tmp_path, capsys):
    values, report = tmp_path / "new" / "soil.json", tmp_path / "docs" / "report.md"
    assert main(["--only=first", f"--json={values}", f"--report={report}"]) == 0
    written = json.loads(values.read_text())
    assert written["experiments"]["first"]["checks"][0]["value"] == 0.5
    assert written["experiments"]["first"]["checks"][0]["low"] is None
    assert written["fidelity"] == "standard"
    assert "## first" in report.read_text()
    assert str(report) in capsys.readouterr().out


def test_only_an_earlier_report_is_replaced(asked, tmp_path, capsys):
    report, values = tmp_path / "report.md", tmp_path / "soil.json"
    for _ in range(2):
        assert main(["--only=first", f"--report={report}"]) == 0
    (tmp_path / "thesis.md").write_text("# Written by me")
    values.write_text("mine")
    for option, name in (("report", "thesis.md"), ("json", "soil.json")):
        with pytest.raises(SystemExit):
            main(["--only=first", f"--{option}={tmp_path / name}"])
        assert f"{name} exists, and is not a report of this command" in capsys.readouterr().err
    assert (values.read_text(), (tmp_path / "thesis.md").read_text()) == ("mine", "# Written by me")


def test_pictures_of_another_report_are_kept(asked, tmp_path, capsys):
    (tmp_path / "images" / "soil").mkdir(parents=True)
    (tmp_path / "images" / "soil" / "heap.png").write_text("mine")
    with pytest.raises(SystemExit):
        main(["--only=first", f"--report={tmp_path / 'report.md'}"])
    assert "images/soil holds pictures" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--only=dance"], "--only='dance'"),
        (["--seeds=a"], "--seeds: 'a'"),
        (["--seeds=-1"], "--seeds=(-1,)"),
        (["--soil=mud"], "'mud'"),
        (["--fidelity=best"], "'best'"),
        (["--report", "--only=first"], "--only would replace"),
        (["--report", "--quick"], "--quick would replace"),
        (["--json=."], "name a file"),
    ],
)
def test_options_that_cannot_be_are_named_before_anything_runs(asked, options, named, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match="2"):
        main(options)
    assert named in capsys.readouterr().err
    assert not asked
    assert not list(tmp_path.iterdir())
