"""Where a dataset takes the place of another, nothing else is touched and nothing fails half-way."""

from pathlib import Path

import pytest

from lerobot_excav.datasets.complete.exchange import copy_foreign_files, exchange, workspace


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
    exchange(new, root, aside)
    assert tree(root) == NEW | {"notes.txt": "mine"}
    assert tree(aside) == {path: text for path, text in OLD.items() if path != "notes.txt"}


@pytest.mark.parametrize("failing", range(5))
def test_an_exchange_that_fails_half_way_puts_everything_back(make, failing, monkeypatch):
    root, new, aside = make("root", OLD), make("new", NEW), make("aside", {})
    rename, moved = Path.rename, []

    def rename_or_fail(path, destination):
        moved.append(path)
        if len(moved) == failing + 1:
            raise OSError("disk full")
        return rename(path, destination)

    monkeypatch.setattr(Path, "rename", rename_or_fail)
    with pytest.raises(OSError, match="disk full"):
        exchange(new, root, aside)
    assert tree(root) == OLD
    assert tree(new) == NEW
    assert not aside.exists()


def test_a_folder_in_the_way_is_not_touched(make):
    root, new, aside = make("root", OLD), make("new", NEW), make("aside", {"thesis.txt": "mine"})
    with pytest.raises(FileExistsError):
        exchange(new, root, aside)
    assert (tree(root), tree(new), tree(aside)) == (OLD, NEW, {"thesis.txt": "mine"})


def test_files_that_lerobot_does_not_know_are_kept_among_its_own(make):
    mine = {"meta/thesis.txt": "mine", "data/c/notes.txt": "mine", "images/k/picture.png": "mine"}
    root, new = make("root", OLD | mine), make("new", NEW)
    copy_foreign_files(root, new)
    assert tree(new) == NEW | mine
    assert tree(root) == OLD | mine


def test_a_workspace_lies_beside_a_dataset_and_is_removed_alone(make, tmp_path):
    root = make("root", OLD)
    make(".root.mine", {"thesis.txt": "mine"})
    with workspace(beside=root) as folder:
        assert folder.parent == tmp_path
        (folder / "part").mkdir()
    assert sorted(path.name for path in tmp_path.iterdir()) == [".root.mine", "root"]
    assert tree(root) == OLD
