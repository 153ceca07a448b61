"""A workflow keeps to its own folders, whoever gives it others."""

import runpy
from pathlib import Path

import pytest

FOLDERS = runpy.run_path(str(Path(__file__).parents[1] / "workflows" / "folders.smk"))


@pytest.mark.parametrize("config", [{}, {"data_shards": 3, "play_shards": 2}])
def test_both_folders_have_the_name_of_the_workflow(config):
    assert FOLDERS["folders"](config, "arm") == ("outputs/arm", "results/arm")
    assert FOLDERS["folders"]({**config, "out": "o", "results": "r"}, "arm") == ("o", "r")


def test_rows_of_other_numbers_do_not_come_to_stand_among_those_that_have_landed():
    assert FOLDERS["folders"]({"steps": 4, "results": "elsewhere"}, "arm") == ("outputs/arm", "elsewhere")
    with pytest.raises(Exception, match="--config out_of steps makes rows that are not those of the table"):
        FOLDERS["folders"]({"steps": 4, "out": "o", "out_of": 3}, "arm")


def test_a_folder_is_made_and_known_again(tmp_path):
    out = tmp_path / "new" / "out"
    FOLDERS["claim"](out, "arm")
    (out / "data").mkdir()
    FOLDERS["claim"](out, "arm")
    assert {path.name for path in out.iterdir()} == {".arm_workflow", "data"}


def test_a_folder_that_holds_something_else_is_left_as_it_is(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    (tmp_path / ".digger_workflow").touch()  # of another workflow
    with pytest.raises(Exception, match="holds something that this workflow has not made"):
        FOLDERS["claim"](tmp_path, "arm")
    assert {path.name for path in tmp_path.iterdir()} == {"thesis.tex", ".digger_workflow"}
