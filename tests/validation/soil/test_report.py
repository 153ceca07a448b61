import re
from pathlib import Path

import pytest

from lerobot_excav.errors import ConfigurationError
from validation.soil.catalogue import EXPERIMENTS, chosen
from validation.soil.experiment import Conditions, SoilExperiment
from validation.soil.report import report_text, write_report
from validation.soil.results import Check, Plot, Result, Series, Table

REPORT = Path(__file__).parents[3] / "docs" / "explanation" / "soil_validation.md"

CURVES = (
    Series("law", (1.0, 2.0), (1.0, 2.0), style="line"),
    Series("gate", (1.0, 2.0), (0.5, 1.0), y_high=(2.0, 3.0)),
)
RESULT = Result(
    checks=(Check("fall time", 0.2, "%", high=1.0), Check("run-out of 30°", 0.7, low=0.9, high=1.6)),
    tables=(Table(("soil", "mass [kg]"), (("sand", 485.0),)),),
    plots=(Plot("falling", "Falling", "t [s]", "z [m]", CURVES),),
    remarks=("Two runs.",),
)


def experiment(**reasons):
    words = {"source": "Newton", "measures": "Soil falls", "gate": "as fast as it should"}
    return SoilExperiment(name="falling", title="Falling soil", run=lambda _: RESULT, reasons=reasons, **words)


def test_a_missed_gate_is_told_with_its_distance_and_its_reason():
    text = report_text([(experiment(**{"run-out": "Too few parcels."}), RESULT)], Conditions())
    assert "1 of 2 gated values are inside" in text
    assert "**missed** by 0.2" in text
    assert "**Missed: run-out of 30°**, by 0.2. Too few parcels." in text
    assert "**Missed: fall time**" not in text


def test_the_report_says_what_nobody_has_explained_and_names_the_simulation_and_links_to_the_sections():
    text = report_text([(experiment(), RESULT)], Conditions())
    assert "Not explained yet." in text
    assert re.search(r"version \d+ of the simulation", text)
    assert "(#falling-soil)" in text
    assert "## Falling soil" in text


def test_the_report_is_written_with_its_plots_and_the_same_plot_is_the_same_file(tmp_path):
    for name in ("one", "two"):
        write_report([(experiment(), RESULT)], Conditions(), tmp_path / name / "report.md")
    text = (tmp_path / "one" / "report.md").read_text()
    assert "![Falling](images/soil/falling.png)" in text
    assert "| sand | 485 |" in text
    files = [(tmp_path / name / "images" / "soil" / "falling.png").read_bytes() for name in ("one", "two")]
    assert files[0] == files[1]
    assert files[0].startswith(b"\x89PNG")


def test_experiments_are_chosen_by_name_in_the_order_of_the_report():
    assert [e.name for e in chosen("ledger, heap")] == ["heap", "ledger"]
    assert chosen(None) == list(EXPERIMENTS)
    assert len({e.name for e in EXPERIMENTS}) == len(EXPERIMENTS)


@pytest.mark.parametrize("seeds", [(), (-1,)])
def test_seeds_that_cannot_be_are_refused(seeds):
    with pytest.raises(ConfigurationError, match="--seeds"):
        Conditions(seeds=seeds)


def test_the_report_of_the_repository_has_every_experiment_and_picture():
    text = REPORT.read_text()
    for one in EXPERIMENTS:
        assert f"## {one.title}" in text
    for picture in re.findall(r"!\[.*?\]\((.*?)\)", text):
        assert (REPORT.parent / picture).is_file()
    assert "quick" not in text.split("##")[0]
