import errno
import os
import re
import subprocess
import sys
from importlib.metadata import version
from unittest.mock import Mock

import pytest

from lerobot_excav.errors import DatasetError
from lerobot_excav.scripts import report
from lerobot_excav.scripts.main import COMMANDS, main


def test_help_of_the_whole_lists_every_command(capsys):
    with pytest.raises(SystemExit) as exit_info:
        main(["--help"])
    assert exit_info.value.code == 0
    text = capsys.readouterr().out
    assert all(f"\n  {name} " in text for name in COMMANDS)


def test_the_version_is_told(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"lerobot-excav {version('lerobot_env_excav')}\n"


def test_help_loads_nothing_heavy():
    code = (
        "import sys; from lerobot_excav.scripts.main import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "sys.exit(bool({'torch', 'lerobot', 'mujoco', 'numba', 'pandas'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode == 0


def test_an_unknown_command_is_refused(capsys):
    with pytest.raises(SystemExit) as exit_info:
        main(["dig"])
    assert exit_info.value.code == 2
    assert "invalid choice: 'dig'" in capsys.readouterr().err


def test_an_error_is_one_line_and_exit_code_2(capsys, tmp_path):
    (tmp_path / "file").write_text("")
    assert main(["index", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert error == f"lerobot-excav index: {tmp_path} is not a LeRobot dataset: it has no meta/info.json\n"
    for folder in (tmp_path / "file", tmp_path / "nowhere"):
        assert main(["qc", str(folder)]) == 2
        error = capsys.readouterr().err
        assert error == f"lerobot-excav qc: {folder} is not a folder; give the folder of a dataset\n"
    for command, missing in (("qc", "dataset"), ("demos", "--out"), ("operator", "--metrics")):
        assert main([command]) == 2
        assert f"{missing} is missing" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "code", "text"), [(KeyboardInterrupt(), 130, "interrupted"), (DatasetError("damaged"), 2, "damaged")]
)
def test_ctrl_c_and_errors_of_this_package_have_their_own_codes(monkeypatch, capsys, error, code, text):
    def fail(_):
        raise error

    monkeypatch.setattr(report, "run", fail)
    assert main(["report", "x"]) == code
    assert capsys.readouterr().err.strip() == f"lerobot-excav report: {text}"


@pytest.mark.parametrize(
    ("number", "advice"),
    [
        (errno.ENOSPC, r"free some space there, or write elsewhere\. What was finished is kept; .* --resume=true"),
        (errno.EDQUOT, "free some space"),
        (errno.EROFS, "choose a place where you may read and write"),
        (errno.EACCES, "choose a place where you may read and write"),
        (errno.ENOENT, "check the path"),
        (errno.EMFILE, "ulimit -n"),
        (errno.EIO, "the disk or the network drive fails"),
    ],
)
def test_an_error_of_the_disk_names_the_file_and_what_to_do(monkeypatch, capsys, number, advice):
    errors = [OSError(number, os.strerror(number), "out/a.json"), OSError(f"[Errno {number}] out/a.json: cannot write")]
    for error in errors:
        monkeypatch.setattr(report, "run", Mock(side_effect=error))
        assert main(["report", "x"]) == 2
        assert re.fullmatch(rf"lerobot-excav report: .*out/a\.json: .*{advice}.*\n", capsys.readouterr().err)


def test_where_a_machine_has_ascii_only_texts_are_still_read_and_printed(tmp_path):
    rows = tmp_path / "rows.toml"
    text = f'title = "5 – 7 × ±"\nmetrics = "{tmp_path}"\n[[section]]\ntitle = "ü"\n'
    rows.write_text(text, encoding="utf-8")
    ascii_only = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": ""}
    command = [sys.executable, "-m", "lerobot_excav.scripts.main", "report", f"--rows={rows}"]
    done = subprocess.run(command, env=os.environ | ascii_only, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    assert b"# 5 ? 7 ? ?" in done.stdout


def test_a_defect_of_the_program_keeps_its_traceback(monkeypatch):
    def fail(_):
        raise RuntimeError("a bug")

    monkeypatch.setattr(report, "run", fail)
    with pytest.raises(RuntimeError, match="a bug"):
        main(["report", "x"])
