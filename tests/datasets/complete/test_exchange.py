"""Where a dataset takes the place of another, nothing else is touched and nothing fails half-way."""

import pytest

from lerobot_excav.datasets.complete.exchange import exchange, keep_foreign_files, workspace


def tree(root):
    return {str(path.relative_to(root)): path.read_text() for path in sorted(root.rglob("*")) if path.is_file()}


@pytest.fixture
def make(tmp_path):
    def _make(name, files):
        for path, text in files.items():
            file = tmp_path / name / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        return tmp_path / name

    return _make


OLD = {"data/c/f.parquet": "old", "meta/info.json": "old", "videos/k/c/f.mp4": "old", "notes.txt": "mine"}
NEW = {"data/c/f.parquet": "new", "meta/info.json": "new"}


def test_only_what_lerobot_keeps_is_exchanged(make):
    root, new, aside = make("root", OLD), make("new", NEW), make("aside", {})
    aside.mkdir()
    exchange(new, root, aside)
    assert tree(root) == NEW | {"notes.txt": "mine"}
    assert tree(aside) == {path: text for path, text in OLD.items() if path != "notes.txt"}


def test_an_exchange_that_fails_half_way_puts_everything_back(make):
    root, new, aside = make("root", OLD), make("new", NEW), make("aside", {"meta/thesis.txt": "in the way"})
    with pytest.raises(OSError, match="not empty"):
        exchange(new, root, aside)
    assert tree(root) == OLD
    assert tree(new) == NEW
    assert tree(aside) == {"meta/thesis.txt": "in the way"}


def test_files_that_lerobot_does_not_know_stay_where_they_were(make):
    mine = {"meta/thesis.txt": "mine", "data/c/notes.txt": "mine", "meta/excav_demonstrations.json": "mine"}
    old, root = make("old", OLD | mine), make("root", NEW)
    keep_foreign_files(old, root)
    assert tree(root) == NEW | mine | {"notes.txt": "mine"}


def test_a_workspace_lies_beside_a_dataset_and_is_removed_alone(make, tmp_path):
    root = make("root", OLD)
    make(".root.mine", {"thesis.txt": "mine"})
    with workspace(beside=root) as folder:
        assert folder.parent == tmp_path
        (folder / "part").mkdir()
    assert sorted(path.name for path in tmp_path.iterdir()) == [".root.mine", "root"]
    assert tree(root) == OLD
