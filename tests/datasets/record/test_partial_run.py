"""What a run may remove: what it has written, and nothing else."""

import errno
import fcntl
import json
import logging
import shutil
import subprocess
import sys

import numpy as np
import pytest

from lerobot_excav.datasets.record.partial_run import PartialRun
from lerobot_excav.datasets.record.simulation import simulate_episode
from lerobot_excav.errors import DatasetError
from lerobot_excav.run_lock import RunLock

from ..toy import record_toy, toy_settings

ONE = {"scenes": 1, "targets": 1}


def partial_run(out, *, resume=False, **settings):
    return PartialRun(out, toy_settings(**settings), resume=resume)


def thesis_in(folder):
    folder.mkdir(parents=True)
    (folder / "thesis.tex").write_text("years of work")
    return folder / "thesis.tex"


@pytest.mark.parametrize("resume", [False, True])
@pytest.mark.parametrize("beside", [None, "{}", "[1]", "torn {", '{"simulation_version": 1}'])
def test_a_folder_that_no_run_has_made_is_kept(tmp_path, resume, beside):
    thesis = thesis_in(tmp_path / "v.partial")
    if beside is not None:
        (thesis.parent / "settings.json").write_text(beside)
    before = sorted(thesis.parent.iterdir())
    with pytest.raises(DatasetError, match=r"v\.partial is in the way, and was not made by .* choose another --out"):
        partial_run(tmp_path / "v", resume=resume)
    assert sorted(thesis.parent.iterdir()) == before


def test_a_file_in_the_place_of_the_folder_is_kept(tmp_path):
    (tmp_path / "v.partial").write_text("years of work")
    with pytest.raises(DatasetError, match="is in the way"):
        partial_run(tmp_path / "v", resume=True)
    assert (tmp_path / "v.partial").read_text() == "years of work"


def test_beside_a_finished_dataset_a_folder_of_somebody_else_is_kept(paired_dataset, tmp_path):
    shutil.copytree(paired_dataset, tmp_path / "v")
    thesis = thesis_in(tmp_path / "v.partial")
    assert record_toy(tmp_path / "v", scenes=5, resume=True).episodes == 19
    assert thesis.read_text() == "years of work"


@pytest.mark.parametrize(("seed", "is_kept"), [(0, False), (3, True)], ids=["its own", "another run"])
def test_beside_a_finished_dataset_only_its_own_run_is_tidied_up(paired_dataset, tmp_path, seed, is_kept):
    shutil.copytree(paired_dataset, tmp_path / "v")
    with partial_run(tmp_path / "v", scenes=5, seed=seed) as run:
        (run.episodes / "toy_reach-train-0-0-0.json").write_text("{}")
    record_toy(tmp_path / "v", scenes=5, resume=True)
    assert (tmp_path / "v.partial").exists() == is_kept


def test_files_that_somebody_put_beside_a_run_are_kept_at_its_end(tmp_path, caplog):
    with partial_run(tmp_path / "v", **ONE) as run:
        (run.folder / "notes.txt").write_text("mine")
        (run.episodes / "notes.txt").write_text("mine")
    with caplog.at_level(logging.WARNING):
        assert record_toy(tmp_path / "v", resume=True, **ONE).episodes == 1
    kept = sorted(path.relative_to(run.folder).as_posix() for path in run.folder.rglob("*"))
    assert kept == ["episodes", "episodes/notes.txt", "notes.txt"]
    assert "notes.txt in it is not of the run" in caplog.text


def test_a_file_in_the_unfinished_dataset_that_is_not_of_it_stops_the_run(tmp_path):
    with partial_run(tmp_path / "v") as run:
        thesis = thesis_in(run.dataset / "data")
    with pytest.raises(DatasetError, match=r"thesis\.tex is not of the run.*move it elsewhere"):
        partial_run(tmp_path / "v", resume=True)
    assert thesis.exists()


@pytest.mark.parametrize("resume", [False, True])
def test_a_run_that_is_at_work_is_named_as_such_and_not_as_interrupted(tmp_path, resume):
    with (
        partial_run(tmp_path / "v"),
        pytest.raises(DatasetError, match=r"another process is at work on \S*v\.partial; wait for it, or stop it$"),
    ):
        partial_run(tmp_path / "v", resume=resume)
    with pytest.raises(DatasetError, match="interrupted run; continue it with --resume, or remove"):
        partial_run(tmp_path / "v")


def test_a_run_that_was_killed_at_once_is_in_nobodys_way(tmp_path):
    (tmp_path / "v.partial").mkdir()
    (tmp_path / "v.partial" / ".excav_demos.lock").touch()
    (tmp_path / "v.partial" / ".settings.json.0123456789ab.tmp").write_text("{")
    assert record_toy(tmp_path / "v", **ONE).episodes == 1
    assert [path.name for path in tmp_path.iterdir()] == ["v"]


def test_a_file_of_somebody_else_is_not_taken_for_a_lock(tmp_path):
    file = tmp_path / ".o.jsonl.lock"
    file.write_text("the keys are under the mat")
    with pytest.raises(DatasetError, match=r"\.o\.jsonl\.lock is needed as a lock .* move it elsewhere"):
        RunLock(file, tmp_path / "o.jsonl.partial")
    assert file.read_text() == "the keys are under the mat"


@pytest.fixture
def flock_fails(monkeypatch):
    def fail_with(number):
        def flock(*_):
            raise OSError(number, "no locks here")

        monkeypatch.setattr(fcntl, "flock", flock)

    return fail_with


def test_where_nothing_can_be_locked_a_run_says_what_to_do(tmp_path, flock_fails):
    flock_fails(errno.ENOLCK)
    with pytest.raises(DatasetError, match=r"cannot be locked .* choose a folder on a disk of this machine"):
        partial_run(tmp_path / "v")


@pytest.mark.filterwarnings("ignore:flock not supported")
def test_where_there_is_no_flock_another_lock_keeps_a_second_process_away(tmp_path, flock_fails):
    flock_fails(errno.ENOSYS)
    with partial_run(tmp_path / "v"), pytest.raises(DatasetError, match="another process"):
        partial_run(tmp_path / "v", resume=True)
    with partial_run(tmp_path / "v", resume=True):
        pass


def test_a_run_needs_no_fcntl():
    code = "import sys; sys.modules['fcntl'] = None; import lerobot_excav.run_lock"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def change_outcome(json_path, _):
    json_path.write_text(json.dumps({"pair_uid": json.loads(json_path.read_text())["pair_uid"]}))


def change_frames(_, npz_path):
    with np.load(npz_path) as stored:
        arrays = {key: stored[key] for key in stored.files}
    np.savez(npz_path, **{key: array * 0 if key.startswith("png:") else array for key, array in arrays.items()})


def leave_out_a_trace(_, npz_path):
    with np.load(npz_path) as stored:
        arrays = {key: stored[key] for key in stored.files if key != "state"}
    np.savez(npz_path, **arrays)


@pytest.mark.parametrize("change", [change_outcome, change_frames, leave_out_a_trace])
def test_an_episode_that_lacks_something_is_damaged_as_well(tmp_path, change):
    with partial_run(tmp_path / "v", **ONE) as run:
        (pair,) = toy_settings(**ONE).pairs()
        simulate_episode(toy_settings(**ONE), pair, run.episodes)
        change(*(next(run.episodes.glob(f"*.{suffix}")) for suffix in ("json", "npz")))
    with pytest.raises(DatasetError, match=r"is missing or damaged; remove \S*\.json, and go on with"):
        record_toy(tmp_path / "v", resume=True, **ONE)


@pytest.mark.parametrize("episodes", [5, [{}], [5]])
def test_a_finished_run_whose_record_is_damaged_is_named(tmp_path, episodes):
    record_toy(tmp_path / "v", **ONE)
    path = tmp_path / "v/meta/excav_demonstrations.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"episodes": episodes}))
    with pytest.raises(DatasetError, match=r"excav_demonstrations\.json cannot be read"):
        record_toy(tmp_path / "v", resume=True, **ONE)


@pytest.mark.parametrize("name", ["thesis.json", "photo.png"])
def test_files_of_others_in_the_unfinished_dataset_are_kept(tmp_path, name):
    with partial_run(tmp_path / "v", **ONE) as run:
        run.dataset.mkdir()
        (run.dataset / name).write_text("mine")
    with pytest.raises(DatasetError, match=rf"{name} is not of the run, .* move it elsewhere"):
        record_toy(tmp_path / "v", resume=True, **ONE)
    assert (run.dataset / name).read_text() == "mine"


def test_a_link_that_leads_nowhere_is_in_the_way_before_anything_is_played(tmp_path):
    (tmp_path / "v").symlink_to(tmp_path / "nowhere")
    with pytest.raises(DatasetError, match=r"--out=.*v exists"):
        record_toy(tmp_path / "v", **ONE)


@pytest.mark.parametrize("suffix", ["json", "npz"])
@pytest.mark.parametrize("damage", [b"", b"\x00" * 40, b'{"pair_uid": "other"}'], ids=["empty", "zeros", "other"])
def test_a_damaged_episode_is_named_with_the_way_out(tmp_path, suffix, damage):
    with partial_run(tmp_path / "v", **ONE) as run:
        (pair,) = toy_settings(**ONE).pairs()
        simulate_episode(toy_settings(**ONE), pair, run.episodes)
        (path,) = run.episodes.glob(f"*.{suffix}")
        path.write_bytes(damage)
    with pytest.raises(DatasetError, match=rf"{path.name} is missing or damaged; remove \S*\.json, and go on with"):
        record_toy(tmp_path / "v", resume=True, **ONE)
    path.with_suffix(".json").unlink()
    assert record_toy(tmp_path / "v", resume=True, **ONE).episodes == 1
