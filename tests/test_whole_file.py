import errno
import os
from pathlib import Path

import pytest

from lerobot_excav.whole_file import unfinished, whole_file, write_whole


def test_text_is_utf_8_whatever_the_machine_prefers_and_nothing_is_left_beside(tmp_path):
    write_whole(tmp_path / "a.txt", "5 – 7 × ±")
    assert (tmp_path / "a.txt").read_bytes() == "5 – 7 × ±".encode()
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_after_a_failure_the_old_file_is_there_and_the_error_names_it(tmp_path):
    (tmp_path / "a.txt").write_text("old")

    def fail():
        with whole_file(tmp_path / "a.txt") as temporary:
            temporary.write_text("half")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(OSError, match=r"No space left on device: '.*a\.txt'") as caught:
        fail()
    assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, str(tmp_path / "a.txt"))
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"


def test_a_full_disk_names_the_file(tmp_path, monkeypatch):
    def write_bytes(_, content):
        with Path("/dev/full").open("wb") as file:
            file.write(content)

    monkeypatch.setattr(Path, "write_bytes", write_bytes)
    with pytest.raises(OSError, match=r"No space left on device: '.*a\.json'"):
        write_whole(tmp_path / "a.json", "{}")


def test_a_link_stays_and_its_file_is_replaced(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link.txt").symlink_to(tmp_path / "real" / "a.txt")
    write_whole(tmp_path / "link.txt", "new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real" / "a.txt").read_text() == "new"


def test_what_a_kill_left_is_told_from_files_of_others(tmp_path):
    with whole_file(tmp_path / "a.npz") as temporary:
        temporary.write_text("x")
        assert unfinished(temporary) == "a.npz"
    assert unfinished(tmp_path / "a.npz") is None
    assert unfinished(tmp_path / ".notes.tmp") is None
