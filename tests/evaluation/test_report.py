import pytest
import toy_reach  # noqa: F401 - registers a task whose record tells nothing of the mask that was obeyed

from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.report import make_report
from lerobot_excav.evaluation.report_text import report_text


@pytest.fixture
def runs(make_run, scoop_line):
    half = make_run("half", [scoop_line(i, target_success=i % 2 == 0, retained_mass_kg=150.0) for i in range(10)])
    full = make_run("full", *[[scoop_line(i, retained_mass_kg=280.0) for i in range(10)]] * 2)
    return [half, full]


@pytest.fixture
def operator(make_run, scoop_line):
    return make_run("operator", [scoop_line(i, operator="scripted", retained_mass_kg=400.0) for i in range(12)])


def test_rates_count_episodes_and_masses_count_scenes(runs):
    half, full = make_report(runs).runs
    assert half["target_success"].estimate == 0.5
    assert half.counts == {"episodes": 10, "seeds": 1, "scenes": 10}
    assert full["target_success"].estimate == 1.0
    assert full.counts == {"episodes": 20, "seeds": 2, "scenes": 10}
    assert full["retained_mass_kg"].estimate == 280.0
    assert half["efficiency"] is None


def test_efficiency_relates_to_the_operator_on_the_same_scenes(runs, operator):
    report = make_report(runs, operator=operator)
    assert [row.run.label for row in report.runs] == ["half", "full", "operator"]
    assert [run["efficiency"].estimate for run in report.runs] == pytest.approx([0.375, 0.7, 1.0])
    assert report.operator == "scripted"


def test_the_text_shows_every_number_with_its_interval(runs, operator):
    text = report_text(make_report(runs, operator=operator))
    assert "50.0 [23.7, 76.3]" in text  # Wilson, 5 of 10
    assert "37.5 [37.5, 37.5]" in text
    assert "## full - half" in text
    assert "+130.0 [+130.0, +130.0]" in text
    assert "operator: scripted" in text


def test_a_file_with_several_evaluations_is_noted(make_run, scoop_line):
    run = make_run("a", [scoop_line(0), scoop_line(0)])
    assert "holds 2 evaluations; the last one is used" in report_text(make_report([run]))


def test_the_seed_of_the_bootstrap_is_stated_and_has_an_effect(make_run, scoop_line):
    run = make_run("a", [scoop_line(i, retained_mass_kg=37.0 * i % 11) for i in range(10)])
    first, second = (make_report([run], seed=seed) for seed in (0, 5))
    assert first.runs[0]["retained_mass_kg"] != second.runs[0]["retained_mass_kg"]
    assert "seed 5" in report_text(second)


@pytest.mark.parametrize(
    "changes",
    [{"soil": "gravel"}, {"density": "heavy"}, {"pile": "ridge"}, {"fidelity": "fast"}, {"simulation_version": 1}],
)
def test_runs_whose_scenes_differ_stand_side_by_side_but_are_not_related(runs, make_run, scoop_line, changes):
    other = make_run("other", [scoop_line(i, **changes) for i in range(10)])
    with pytest.raises(DatasetError, match=r"half dug sand at standard fidelity in version 5 .* and other dug"):
        make_report(runs[:1], operator=other)
    report = make_report([runs[0], other])
    assert report.differences == {}
    assert "no paired differences to other: half dug sand at standard fidelity in version 5" in report_text(report)


def test_commands_may_change_at_other_frames_in_every_episode(make_run, grasp_line):
    own = {"task": "Reach-v0", "table": "ice"}
    lines = [grasp_line(i, **own, final_distance_m=2.0 + i, commands=[[0, i], [10 + i, 3]]) for i in range(3)]
    run = make_run("a", lines)
    assert run.setting == {"table": "ice", "mask": "correct, changed at frame 10 (and 2 others)"}
    assert run.episodes[0].obeyed_shown_mask is None
    assert "3.0 [2.0, 4.0]" in report_text(make_report([run]))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "sand"),
        ({"density": "heavy"}, "heavy sand"),
        ({"soil": "gravel", "pile": "two_heaps"}, "gravel, two heaps"),
    ],
)
def test_a_row_tells_what_was_dug(make_run, scoop_line, changes, words):
    assert make_run("a", [scoop_line(0, **changes)]).setting["soil"] == words


def test_the_text_names_soil_fidelity_and_version(make_run, scoop_line):
    runs = [make_run(soil, [scoop_line(0, soil=soil)]) for soil in ("sand", "gravel")]
    text = report_text(make_report(runs))
    assert "| gravel | gravel | correct" in text
    assert "- Simulation: version 5, standard fidelity of the soil." in text
    runs.append(make_run("fine", [scoop_line(0, fidelity="fine")]))
    assert "fine: version 5, fine fidelity of the soil" in report_text(make_report(runs))
