import subprocess

import pytest

from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.experiment import stage_record
from lerobot_excav.evaluation.experiment.stage_record import new_record, record_from


@pytest.mark.parametrize(
    ("tracked", "commit_length"),
    [pytest.param(True, 40, id="tracked"), pytest.param(False, None, id="ignored")],
)
def test_the_commit_is_only_that_of_a_repository_that_holds_the_package(
    tmp_path, monkeypatch, tracked, commit_length
):
    package = tmp_path / "lerobot_excav"
    package.mkdir()
    (package / "__init__.py").touch()
    (tmp_path / "README.md").touch()
    for arguments in (
        ["init", "--quiet"],
        ["add", "." if tracked else "README.md"],
        ["-c", "user.name=A", "-c", "user.email=a@b.c", "commit", "--quiet", "--message=First"],
    ):
        subprocess.run(["git", *arguments], cwd=tmp_path, check=True)
    monkeypatch.setattr(stage_record, "__file__", str(package / "evaluation" / "experiment" / "x.py"))
    commit = new_record("data", "true", {}, needs={}, training=None).commit
    assert (commit and len(commit)) == commit_length


def test_a_file_that_is_no_record_is_named_with_what_is_unlike(tmp_path):
    with pytest.raises(
        DatasetError, match=r"a\.json is no record of a stage, by its entries .*command.*, mine,"
    ):
        record_from({"mine": 1}, tmp_path / "a.json")
