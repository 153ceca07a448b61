"""A report replaces and removes its own files only."""

import json
from pathlib import Path

import pytest

from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.report_folder import LIST, ReportFolder


def write(folder, **files):
    with ReportFolder(folder).staged() as stage:
        for name, text in files.items():
            path = stage / name.replace("_", ".").replace("..", "/")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)


def texts(folder):
    return {path.name: path.read_text() for path in folder.rglob("*") if path.is_file() and path.name != LIST}


def test_a_report_replaces_an_earlier_one(tmp_path):
    write(tmp_path, report_md="first")
    write(tmp_path, report_md="second", metrics__a_jsonl="1")
    assert texts(tmp_path) == {"report.md": "second", "a.jsonl": "1"}
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_a_file_that_no_report_has_written_is_kept_and_nothing_is_replaced(tmp_path):
    write(tmp_path, report_md="first")
    (tmp_path / "rows.jsonl").write_text("mine")
    with pytest.raises(DatasetError, match=r"rows\.jsonl was not written by a report; move it elsewhere, or choose"):
        write(tmp_path, report_md="second", rows_jsonl="theirs")
    assert texts(tmp_path) == {"report.md": "first", "rows.jsonl": "mine"}


def test_a_report_that_somebody_has_edited_is_kept(tmp_path):
    write(tmp_path, report_md="first")
    (tmp_path / "report.md").write_text("first, with a remark")
    with pytest.raises(DatasetError, match=r"report\.md was changed since a report wrote it"):
        write(tmp_path, report_md="second")
    assert texts(tmp_path) == {"report.md": "first, with a remark"}


def test_only_own_files_are_removed(tmp_path):
    write(tmp_path, metrics__a_jsonl="1", metrics__b_jsonl="2", report_md="3")
    (tmp_path / "metrics" / "b.jsonl").write_text("changed")
    (tmp_path / "metrics" / "c.jsonl").write_text("mine")
    ReportFolder(tmp_path).remove(lambda name: name.startswith("metrics/"))
    assert texts(tmp_path) == {"b.jsonl": "changed", "c.jsonl": "mine", "report.md": "3"}


@pytest.mark.parametrize("reached", [0, 1])
def test_a_report_that_was_killed_while_it_replaced_can_be_written_again(tmp_path, monkeypatch, reached):
    write(tmp_path, a_md="old", b_md="old")
    replaced = []

    def killed(self, files, record=ReportFolder._list):
        if replaced:
            raise KeyboardInterrupt
        replaced.append(files)
        record(self, files)

    with monkeypatch.context() as patch:
        patch.setattr(ReportFolder, "_list", killed)
        with pytest.raises(KeyboardInterrupt):
            write(tmp_path, a_md="new", b_md="new")
    if not reached:
        (tmp_path / "b.md").write_text("old")
    write(tmp_path, a_md="newer", b_md="newer")
    assert texts(tmp_path) == {"a.md": "newer", "b.md": "newer"}


def test_a_report_that_was_killed_twice_before_it_replaced_anything_can_be_written_again(tmp_path, monkeypatch):
    write(tmp_path, a_md="old")
    for text in ("new", "newer"):
        with monkeypatch.context() as patch:
            patch.setattr(Path, "replace", replace_the_list_only)
            with pytest.raises(KeyboardInterrupt):
                write(tmp_path, a_md=text)
    write(tmp_path, a_md="newest")
    assert texts(tmp_path) == {"a.md": "newest"}


def replace_the_list_only(path, target, replace=Path.replace):
    if target.name != LIST:
        raise KeyboardInterrupt
    return replace(path, target)


@pytest.mark.parametrize("name", ["../thesis.tex", "/thesis.tex"])
def test_a_list_that_names_files_elsewhere_is_refused(tmp_path, name):
    (tmp_path / LIST).write_text(json.dumps({"written_by": "lerobot-excav report", "files": {name: ["0"]}}))
    with pytest.raises(DatasetError, match="lies outside of the folder"):
        ReportFolder(tmp_path)


@pytest.mark.parametrize(
    "text", ["", "{", "3", "{}", '{"files": 3}', '{"files": {}, "written_by": "me"}', '{"mine": 1}']
)
def test_a_list_of_somebody_else_is_named(tmp_path, text):
    (tmp_path / LIST).write_text(text)
    with pytest.raises(DatasetError, match=LIST):
        ReportFolder(tmp_path)
