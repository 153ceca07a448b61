"""Counting the cycles that were replayed through the page; the page itself is tried in tests/browser."""

import json

from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from validation.finished_plays import read_finished
from validation.page_operator.__main__ import summary


def cycle(scene_id, *, is_success, **changes):
    values = {"scene_id": scene_id, "target_id": 0, "is_success": is_success, "is_success_without_page": True}
    return {"simulation_version": SCOOP.simulation_version, **values, **changes}


def test_a_line_that_was_cut_short_is_played_again(tmp_path):
    path = tmp_path / "cycles.jsonl"
    path.write_text(json.dumps(cycle(0, is_success=True)) + "\n" + json.dumps(cycle(1, is_success=True))[:20])
    assert [each["scene_id"] for each in read_finished(path)] == [0]
    assert path.read_text().endswith("}\n")
    assert read_finished(tmp_path / "none.jsonl") == []


def test_cycles_of_another_version_do_not_count(tmp_path):
    path = tmp_path / "cycles.jsonl"
    path.write_text(json.dumps(cycle(0, is_success=True, simulation_version=1)) + "\n")
    assert read_finished(path) == []


def test_the_summary_names_what_the_page_lost():
    lines = summary([cycle(0, is_success=True), cycle(1, is_success=False)])
    assert lines[0].startswith("without the page: 2 of 2, 100% [")
    assert lines[1].startswith("through the page: 1 of 2, 50% [")
    assert lines[2] == "lost through the page: [(1, 0)]"
