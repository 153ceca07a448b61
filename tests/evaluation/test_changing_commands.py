"""Reports of a task whose command changes at other frames in every episode, and whose record tells nothing more."""

from types import SimpleNamespace

import pytest

from lerobot_excav.envs.tasks.measures import Column, EpisodeRecord, Kind, TaskMeasures
from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.evaluation.report import make_report
from lerobot_excav.evaluation.report_text import report_text


class SweepRecord(EpisodeRecord):
    swept_m2: float


MEASURES = TaskMeasures(
    record=SweepRecord,
    settings={},
    shared={},
    setting={"mask": "mask"},
    columns=(
        Column(key="success", header="success [%]", kind=Kind.RATE, field="is_success"),
        Column(key="swept", header="swept [m2]", kind=Kind.MEAN, field="swept_m2"),
    ),
    compared=("success", "swept"),
    world="was swept in version {simulation_version}",
    simulation="version {simulation_version}",
    legend=lambda operator: ["Swept: ground without leaves."],
    outcome=lambda task_state: {},
    summary=lambda index: "",
)


@pytest.fixture
def sweep_line(monkeypatch, grasp_line):
    monkeypatch.setitem(TASKS, "Sweep-v0", SimpleNamespace(id="Sweep-v0", env_type="sweep", measures=MEASURES))
    return lambda number, **changes: grasp_line(number, task="Sweep-v0", swept_m2=2.0 + number, **changes)


def test_commands_may_change_at_other_frames_in_every_episode(make_run, sweep_line):
    lines = [sweep_line(i, commands=[[0, i], [10 + i, 3]]) for i in range(3)]
    run = make_run("a", lines)
    assert run.setting == {"mask": "correct, changed at frame 10 (and 2 others)"}
    assert run.episodes[0].obeyed_shown_mask is None
    text = report_text(make_report([run]))
    assert "3.0 [2.0, 4.0]" in text
    assert "- Swept: ground without leaves." in text
